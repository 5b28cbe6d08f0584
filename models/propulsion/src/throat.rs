//! The course of the throat's area: steady, one of the faults of the chapter on flight diagnostics, or an input.
//!
//! A factor on the area A_t that the model has at its start. Next file to read: [`super::rocket_motor`].

use serde::Deserialize;
use starlings_models_core::Quantity;

/// How the throat's area follows time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Throat {
    /// It stays.
    #[default]
    Steady,
    /// A share of it is lost at once.
    Step,
    /// It shrinks as a cubic of the time since the fault: a part that sinks into the nozzle.
    Polynomial,
    /// A share of it is lost and comes back exponentially: a cloud of particles passes.
    Pulse,
    /// An input gives it.
    Input,
}

/// Share of the area that no fault takes.
const LEAST: f64 = 0.05;
/// Name of the input, where there is one.
pub(crate) const INPUT: &str = "throat_factor";

impl Throat {
    /// Parameters of the course, the time of the fault first.
    pub(crate) fn parameters(self) -> Vec<Quantity> {
        let shared = || Quantity::new("t_f", "s").default(1e3).says("Time of the fault of the throat.");
        let lost = || {
            Quantity::new("change", "")
                .range(LEAST - 1.0, 10.0)
                .default(-0.2)
                .says("Change of the throat's area at the fault, as a share.")
        };
        let coefficient = |name: &str, unit: &str, default: f64, power: &str| {
            let says = format!("Share of the throat's area lost per {power} of the time since the fault.");
            Quantity::new(name, unit).default(default).says(&says)
        };
        match self {
            Self::Steady | Self::Input => Vec::new(),
            Self::Step => vec![shared(), lost()],
            Self::Polynomial => vec![
                shared(),
                coefficient("alpha", "1/s", 0.002, "first power"),
                coefficient("beta", "1/s^2", 1e-4, "second power"),
                coefficient("delta", "1/s^3", 4.2e-4, "third power"),
            ],
            Self::Pulse => vec![
                shared(),
                lost(),
                Quantity::new("tau_f", "s").positive().default(0.6).says("Time in which the loss decays."),
            ],
        }
    }

    /// Input quantities of the course.
    pub(crate) fn inputs(self) -> Vec<Quantity> {
        match self {
            Self::Input => vec![
                Quantity::new(INPUT, "").range(0.0, 10.0).says("Throat area over the one of the parameters."),
            ],
            _ => Vec::new(),
        }
    }

    /// The time at which the area may jump, given the parameters of the course.
    pub(crate) fn onset(self, theta: &[f64]) -> Option<f64> {
        match self {
            Self::Steady | Self::Input => None,
            Self::Step | Self::Polynomial | Self::Pulse => Some(theta[0]),
        }
    }

    /// Area over the one at the start, given the parameters of the course and the model's inputs.
    pub(crate) fn factor(self, t: f64, theta: &[f64], u: &[f64]) -> f64 {
        if self.onset(theta).is_some_and(|onset| t < onset) {
            return 1.0;
        }
        match self {
            Self::Steady => 1.0,
            Self::Input => u[0].max(0.0),
            Self::Step => (1.0 + theta[1]).max(LEAST),
            Self::Polynomial => {
                let tau = t - theta[0];
                let lost = tau * (theta[1] + tau * (theta[2] + tau * theta[3]));
                (1.0 - lost).max(LEAST)
            }
            Self::Pulse => (1.0 + theta[1] * (-(t - theta[0]) / theta[2]).exp()).max(LEAST),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_begins_at_its_onset_and_takes_its_share() {
        let near = |got: f64, want: f64| assert!((got - want).abs() < 1e-15, "{got} for {want}");
        near(Throat::Step.factor(0.9, &[1.0, -0.2], &[]), 1.0);
        near(Throat::Step.factor(1.0, &[1.0, -0.2], &[]), 0.8);
        near(Throat::Polynomial.factor(3.0, &[1.0, 0.01, 0.02, 0.03], &[]), 1.0 - 0.02 - 0.08 - 0.24);
        near(Throat::Polynomial.factor(90.0, &[1.0, 0.01, 0.02, 0.03], &[]), LEAST);
        near(Throat::Pulse.factor(1.0 + 2.0_f64.ln(), &[1.0, -0.15, 1.0], &[]), 1.0 - 0.075);
        near(Throat::Input.factor(7.0, &[], &[0.7]), 0.7);
        near(Throat::Steady.factor(7.0, &[], &[]), 1.0);
    }
}
