//! The laws of resistive branches: flow and conductance for a pressure drop.
//!
//! Each flow is an increasing, once continuously differentiable (a sharp diode: continuous) function of the drop, so its
//! integral over the drop, the co-content (Millar 1951), is convex: what makes the nodal equations uniquely solvable.
//! Next file to read: [`super::solve`].

use super::circuit::Law;

/// A law with its values.
#[derive(Clone, Copy, Debug)]
pub(super) enum Valued {
    /// q = g Δp.
    Linear { conductance: f64 },
    /// Δp = a q + b |q| q (Young & Tsai 1973).
    Loss { linear: f64, quadratic: f64 },
    /// A valve: conductance `open` above zero drop, `closed` below; between 0 and `smooth` it rises linearly.
    Diode { open: f64, closed: f64, smooth: f64 },
}

/// A law at one pressure drop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct At {
    pub(super) flow: f64,
    /// dq/dΔp.
    pub(super) conductance: f64,
}

impl Law {
    pub(super) fn valued(self, theta: &[f64]) -> Valued {
        match self {
            Self::Linear { resistance } => Valued::Linear { conductance: 1.0 / theta[resistance] },
            Self::Loss { linear, quadratic } => {
                Valued::Loss { linear: theta[linear], quadratic: theta[quadratic] }
            }
            Self::Diode { open, closed, smooth } => {
                Valued::Diode { open: 1.0 / theta[open], closed: 1.0 / theta[closed], smooth }
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
        }
    }
}

fn linear(conductance: f64, drop: f64) -> At {
    At { flow: conductance * drop, conductance }
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
    fn a_loss_gives_back_the_flow_that_made_the_drop() {
        let law = Valued::Loss { linear: 0.05, quadratic: 0.002 };
        for flow in [-200.0_f64, -1e-6, 0.0, 1e-9, 3.0, 450.0] {
            let drop = 0.05 * flow + 0.002 * flow.abs() * flow;
            // Rounding of a square root.
            assert!((law.at(drop).flow - flow).abs() <= 1e-14 * flow.abs(), "{flow}");
        }
    }
}
