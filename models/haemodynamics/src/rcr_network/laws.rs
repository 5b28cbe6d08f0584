//! The laws of resistive branches: flow and conductance for a pressure drop.
//!
//! Each flow is an increasing, once continuously differentiable (a sharp diode: continuous) function of the drop, so its
//! integral over the drop, the co-content (Millar 1951), is convex: what makes the nodal equations uniquely solvable.
//! Next file to read: [`super::solve`].

use super::circuit::{Chamber, Law};

/// A law with its values.
#[derive(Clone, Copy, Debug)]
pub(super) enum Valued {
    /// q = g Δp.
    Linear { conductance: f64 },
    /// Δp = a q + b |q| q (Young & Tsai 1973).
    Loss { linear: f64, quadratic: f64 },
    /// A valve: conductance `open` above zero drop, `closed` below; between 0 and `smooth` it rises linearly.
    Diode { open: f64, closed: f64, smooth: f64 },
    /// A valve whose resistance goes from `closed` to `open` as ½ (1 − tanh(k Δp)) (Pfaller et al. 2019).
    Valve { open: f64, closed: f64, steepness: f64 },
}

/// A law at one pressure drop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct At {
    pub(super) flow: f64,
    /// dq/dΔp.
    pub(super) conductance: f64,
}

impl Law {
    /// The law with its values; every branch has at least the resistance `least`, so that zero is an open connection.
    pub(super) fn valued(self, theta: &[f64], least: f64) -> Valued {
        match self {
            Self::Linear { resistance } => Valued::Linear { conductance: 1.0 / theta[resistance].max(least) },
            Self::Loss { linear, quadratic } => {
                Valued::Loss { linear: theta[linear].max(least), quadratic: theta[quadratic] }
            }
            Self::Diode { open, closed, smooth } => {
                let [open, closed] = [open, closed].map(|at| 1.0 / theta[at].max(least));
                Valued::Diode { open, closed, smooth }
            }
            Self::Valve { open, closed, steepness } => {
                let [open, closed] = [open, closed].map(|at| theta[at].max(least));
                Valued::Valve { open, closed, steepness }
            }
        }
    }
}

impl Valued {
    pub(super) fn at(self, drop: f64) -> At {
        match self {
            Self::Linear { conductance } => linear(conductance, drop),
            Self::Loss { linear, quadratic } => {
                let root = (linear * linear + 4.0 * quadratic * drop.abs()).sqrt();
                At { flow: 2.0 * drop / (linear + root), conductance: 1.0 / root }
            }
            Self::Diode { closed, .. } if drop <= 0.0 => linear(closed, drop),
            Self::Diode { open, closed, smooth } => {
                let (base, more) = (linear(closed, drop), open - closed);
                let opening = opening(drop, smooth);
                At {
                    flow: base.flow + more * opening.flow,
                    conductance: base.conductance + more * opening.conductance,
                }
            }
            Self::Valve { open, closed, steepness } => valve(drop, open, closed, steepness),
        }
    }
}

fn linear(conductance: f64, drop: f64) -> At {
    At { flow: conductance * drop, conductance }
}

/// q = Δp/R with R = open + (closed − open)/(1 + e^{2kΔp}): an increasing function, as 1 + e^{2u}(1 + 2u) > 0.
fn valve(drop: f64, open: f64, closed: f64, steepness: f64) -> At {
    let power = (2.0 * steepness * drop).clamp(-700.0, 700.0).exp();
    let shut = 1.0 / (1.0 + power);
    let resistance = open + (closed - open) * shut;
    let bend = 2.0 * steepness * (closed - open) * shut * (power * shut);
    At { flow: drop / resistance, conductance: (1.0 + drop * bend / resistance) / resistance }
}

/// The pressure of a chamber at a volume.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Filled {
    pub(super) pressure: f64,
    /// ∂p/∂V, above zero.
    pub(super) elastance: f64,
    /// ∂p/∂a.
    pub(super) by_activation: f64,
}

impl Chamber {
    /// p = E (V − V₀) + (1 − a) Kp (e^{Kv (V − Vd)} − 1) with E = passive + (active − passive) a and V₀ = Vs + (1 − a)(Vd − Vs) for the
    /// volumes at rest Vd, passive, and Vs, active (Suga & Sagawa 1974; the exponential: Sankaran et al. 2012).
    pub(super) fn at(&self, theta: &[f64], signals: &[f64], volume: f64) -> Filled {
        let a = signals[self.activation];
        let [active, passive] = [theta[self.active], theta[self.passive]];
        let [slack, contracted] = [theta[self.rest], theta[self.rest_active]];
        let elastance = passive + (active - passive) * a;
        let stretch = volume - contracted - (1.0 - a) * (slack - contracted);
        let mut filled = Filled {
            pressure: elastance * stretch,
            elastance,
            by_activation: (active - passive) * stretch + elastance * (slack - contracted),
        };
        if let Some([scale, rate]) = self.wall {
            let (scale, rate) = (theta[scale], theta[rate]);
            let power = (rate * (volume - slack)).min(700.0).exp();
            filled.pressure += (1.0 - a) * scale * (power - 1.0);
            filled.elastance += (1.0 - a) * scale * rate * power;
            filled.by_activation -= scale * (power - 1.0);
        }
        // A chamber without any stiffness would have no volume at a pressure.
        filled.elastance = filled.elastance.max(1e-9 * active.abs().max(passive.abs()));
        filled
    }
}

/// A diode of unit conductance above zero drop.
fn opening(drop: f64, smooth: f64) -> At {
    if drop < smooth {
        At { flow: drop * drop / (2.0 * smooth), conductance: drop / smooth }
    } else {
        At { flow: drop - 0.5 * smooth, conductance: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_conductance_is_the_slope_of_the_flow_and_never_zero() {
        let laws = [
            Valued::Linear { conductance: 0.3 },
            Valued::Loss { linear: 0.05, quadratic: 0.002 },
            Valued::Loss { linear: 0.5, quadratic: 0.0 },
            Valued::Diode { open: 20.0, closed: 1e-3, smooth: 0.0 },
            Valued::Diode { open: 20.0, closed: 1e-3, smooth: 0.7 },
            Valued::Valve { open: 0.05, closed: 20.0, steepness: 0.8 },
        ];
        for law in laws {
            for drop in [-30.0, -0.4, 0.2, 0.6, 0.9, 25.0] {
                let h = 1e-5;
                let [low, mid, high] = [drop - h, drop, drop + h].map(|d| law.at(d));
                // Central differences: rounding 1e-16 · 500 / 1e-5, and h² beyond.
                let slope = (high.flow - low.flow) / (2.0 * h);
                assert!((slope - mid.conductance).abs() < 1e-6 * (1.0 + slope), "{law:?} at {drop}");
                assert!(mid.conductance > 0.0);
            }
        }
    }

    #[test]
    fn a_valve_of_any_steepness_lets_more_through_at_a_larger_drop() {
        for steepness in [1e-3, 1.0, 500.0, 1e6] {
            let law = Valued::Valve { open: 0.01, closed: 7.5e4, steepness };
            let drops = (-300..=300).map(|k| f64::from(k) / (40.0 * steepness));
            let flows: Vec<At> = drops.map(|drop| law.at(drop)).collect();
            assert!(flows.windows(2).all(|pair| pair[0].flow < pair[1].flow), "{steepness}");
            assert!(flows.iter().all(|at| at.conductance > 0.0), "{steepness}");
        }
    }

    #[test]
    fn the_derivatives_of_a_chambers_pressure_are_its_differences() {
        let law =
            Chamber { active: 0, passive: 1, rest: 2, rest_active: 3, wall: Some([4, 5]), activation: 0 };
        let theta = [2.5, 0.1, 26.0, 18.0, 9.2, 0.005];
        let at = |a: f64, volume: f64| law.at(&theta, &[a], volume);
        let (a, volume, h) = (0.3, 90.0, 1e-4);
        let by_volume = (at(a, volume + h).pressure - at(a, volume - h).pressure) / (2.0 * h);
        let by_activation = (at(a + h, volume).pressure - at(a - h, volume).pressure) / (2.0 * h);
        // Central differences: rounding 1e-14 / 1e-4, and h² beyond.
        assert!((at(a, volume).elastance - by_volume).abs() < 1e-8);
        assert!((at(a, volume).by_activation - by_activation).abs() < 1e-6);
        // By hand: E = 0.82, V₀ = 23.6; the wall adds 0.7 · 9.2 (e^{0.32} − 1).
        let wanted = 0.82 * (90.0 - 23.6) + 0.7 * 9.2 * (0.32_f64.exp() - 1.0);
        assert!((at(a, volume).pressure - wanted).abs() < 1e-12 * wanted);
    }

    #[test]
    fn a_loss_gives_back_the_flow_that_made_the_drop() {
        let law = Valued::Loss { linear: 0.05, quadratic: 0.002 };
        for flow in [-200.0_f64, -1e-6, 0.0, 1e-9, 3.0, 450.0] {
            let drop = 0.05 * flow + 0.002 * flow.abs() * flow;
            // Rounding of a square root.
            assert!((law.at(drop).flow - flow).abs() <= 1e-14 * flow.abs(), "{flow}");
        }
    }
}
