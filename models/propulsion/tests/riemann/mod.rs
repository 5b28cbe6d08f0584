//! The exact solution of Riemann's problem for a perfect gas (Toro 2009, "Riemann Solvers and Numerical Methods for Fluid
//! Dynamics", ch. 4).

/// Density, velocity and pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    pub(crate) rho: f64,
    pub(crate) u: f64,
    pub(crate) p: f64,
}

/// Change of velocity across the wave that takes a side to the pressure `p` (eqs. 4.6 and 4.7).
fn wave(side: Side, p: f64, gamma: f64) -> f64 {
    if p > side.p {
        let (a, b) = (2.0 / ((gamma + 1.0) * side.rho), (gamma - 1.0) / (gamma + 1.0) * side.p);
        (p - side.p) * (a / (p + b)).sqrt()
    } else {
        let c = (gamma * side.p / side.rho).sqrt();
        2.0 * c / (gamma - 1.0) * ((p / side.p).powf((gamma - 1.0) / (2.0 * gamma)) - 1.0)
    }
}

/// The state on the ray x/t.
pub(crate) fn exact(left: Side, right: Side, gamma: f64, ray: f64) -> Side {
    let (mut low, mut high) = (0.0, 10.0 * (left.p + right.p));
    for _ in 0..200 {
        let p = 0.5 * (low + high);
        if wave(left, p, gamma) + wave(right, p, gamma) + right.u - left.u > 0.0 { high = p } else { low = p }
    }
    let p = 0.5 * (low + high);
    let u = 0.5 * (left.u + right.u + wave(right, p, gamma) - wave(left, p, gamma));
    if ray <= u {
        behind(left, p, u, gamma, ray)
    } else {
        let mirrored = behind(Side { u: -right.u, ..right }, p, -u, gamma, -ray);
        Side { u: -mirrored.u, ..mirrored }
    }
}

/// The state on a ray left of the contact, which moves with `u` at the pressure `p` (section 4.5).
fn behind(side: Side, p: f64, u: f64, gamma: f64, ray: f64) -> Side {
    let c = (gamma * side.p / side.rho).sqrt();
    let g = (gamma - 1.0) / (gamma + 1.0);
    let ratio = p / side.p;
    if p > side.p {
        let speed =
            side.u - c * ((gamma + 1.0) / (2.0 * gamma) * ratio + (gamma - 1.0) / (2.0 * gamma)).sqrt();
        let rho = side.rho * (ratio + g) / (g * ratio + 1.0);
        return if ray < speed { side } else { Side { rho, u, p } };
    }
    let rho = side.rho * ratio.powf(1.0 / gamma);
    let (head, tail) = (side.u - c, u - (gamma * p / rho).sqrt());
    if ray < head {
        side
    } else if ray > tail {
        Side { rho, u, p }
    } else {
        let share = 2.0 / (gamma + 1.0) + g / c * (side.u - ray);
        let u = 2.0 / (gamma + 1.0) * (c + 0.5 * (gamma - 1.0) * side.u + ray);
        Side {
            rho: side.rho * share.powf(2.0 / (gamma - 1.0)),
            u,
            p: side.p * share.powf(2.0 * gamma / (gamma - 1.0)),
        }
    }
}
