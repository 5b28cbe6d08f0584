//! A perfect gas moving along a line: its state, the flux of its balances, and the flux between two states.
//!
//! Next file to read: [`super::reconstruct`].

/// Density, velocity and pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gas {
    pub(super) rho: f64,
    pub(super) u: f64,
    pub(super) p: f64,
}

impl Gas {
    /// From mass, momentum and energy per volume.
    pub(super) fn of_conserved([rho, momentum, energy]: [f64; 3], gamma: f64) -> Self {
        let u = momentum / rho;
        Self { rho, u, p: (gamma - 1.0) * (energy - 0.5 * momentum * u) }
    }

    /// Energy per volume, kinetic energy included.
    pub(super) fn energy(self, gamma: f64) -> f64 {
        self.p / (gamma - 1.0) + 0.5 * self.rho * self.u * self.u
    }

    /// Whether density and pressure are positive numbers.
    pub(super) fn is_sound(self) -> bool {
        self.rho > 0.0 && self.p > 0.0 && self.u.is_finite() && self.p.is_finite() && self.rho.is_finite()
    }

    /// Speed of sound.
    pub(super) fn sound(self, gamma: f64) -> f64 {
        (gamma * self.p / self.rho).sqrt()
    }

    /// The gas behind a wall that makes this one stop.
    pub(super) fn mirrored(self) -> Self {
        Self { u: -self.u, ..self }
    }

    /// Flux of mass, momentum and energy per area.
    pub(super) fn flux(self, gamma: f64) -> [f64; 3] {
        let mass = self.rho * self.u;
        [mass, mass * self.u + self.p, self.u * (self.energy(gamma) + self.p)]
    }
}

/// Flux per area between two states (Toro, Spruce and Speares 1994, "Restoration of the contact surface in the HLL-Riemann
/// solver", with the wave speeds of Einfeldt 1988 from Roe's averages).
pub(super) fn hllc(left: Gas, right: Gas, gamma: f64) -> [f64; 3] {
    let [slow, fast] = wave_speeds(left, right, gamma);
    if slow >= 0.0 {
        return left.flux(gamma);
    }
    if fast <= 0.0 {
        return right.flux(gamma);
    }
    let (ml, mr) = (left.rho * (slow - left.u), right.rho * (fast - right.u));
    let contact = (right.p - left.p + left.u * ml - right.u * mr) / (ml - mr);
    let (side, wave) = if contact >= 0.0 { (left, slow) } else { (right, fast) };
    let energy = side.energy(gamma);
    let factor = side.rho * (wave - side.u) / (wave - contact);
    let star = [
        factor,
        factor * contact,
        factor * (energy / side.rho + (contact - side.u) * (contact + side.p / (side.rho * (wave - side.u)))),
    ];
    let (flux, own) = (side.flux(gamma), [side.rho, side.rho * side.u, energy]);
    std::array::from_fn(|k| flux[k] + wave * (star[k] - own[k]))
}

fn wave_speeds(left: Gas, right: Gas, gamma: f64) -> [f64; 2] {
    let (wl, wr) = (left.rho.sqrt(), right.rho.sqrt());
    let enthalpy = |gas: Gas| (gas.energy(gamma) + gas.p) / gas.rho;
    let u = (wl * left.u + wr * right.u) / (wl + wr);
    let h = (wl * enthalpy(left) + wr * enthalpy(right)) / (wl + wr);
    let c = ((gamma - 1.0) * (h - 0.5 * u * u)).max(0.0).sqrt();
    [(left.u - left.sound(gamma)).min(u - c), (right.u + right.sound(gamma)).max(u + c)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAMMA: f64 = 1.4;

    fn near(a: [f64; 3], b: [f64; 3]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12 * (1.0 + b.abs())), "{a:?} {b:?}");
    }

    #[test]
    fn the_flux_between_equal_states_is_their_flux_and_a_contact_at_rest_stays() {
        let gas = Gas { rho: 1.3, u: 0.4, p: 0.9 };
        near(hllc(gas, gas, GAMMA), gas.flux(GAMMA));
        let (left, right) = (Gas { rho: 1.0, u: 0.0, p: 0.7 }, Gas { rho: 9.0, u: 0.0, p: 0.7 });
        near(hllc(left, right, GAMMA), [0.0, 0.7, 0.0]);
    }

    #[test]
    fn the_flux_is_reversed_with_its_states_and_nothing_passes_a_wall() {
        let (left, right) = (Gas { rho: 1.0, u: 0.3, p: 1.0 }, Gas { rho: 0.2, u: -0.1, p: 0.3 });
        let [mass, momentum, energy] = hllc(left, right, GAMMA);
        let back = hllc(right.mirrored(), left.mirrored(), GAMMA);
        near(back, [-mass, momentum, -energy]);
        let [mass, _, energy] = hllc(left.mirrored(), left, GAMMA);
        assert!(mass.abs() < 1e-14 && energy.abs() < 1e-14, "{mass} {energy}");
    }

    #[test]
    fn a_supersonic_flow_takes_the_flux_of_where_it_comes_from() {
        let (left, right) = (Gas { rho: 1.0, u: 5.0, p: 1.0 }, Gas { rho: 0.5, u: 4.0, p: 0.8 });
        near(hllc(left, right, GAMMA), left.flux(GAMMA));
        near(hllc(right.mirrored(), left.mirrored(), GAMMA), left.mirrored().flux(GAMMA));
    }
}
