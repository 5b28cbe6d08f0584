//! A gimballed nozzle on its actuator: a damped oscillator under the actuator's force and a torque that something else exerts.
//!
//! One axis, small angles. The actuator's force is measured, or follows a law of its own with a lag. Who exerts the torque is not modelled;
//! what it was is recovered from recordings by `unknown_input` of the estimators. Next file to read: [`crate::plate`].

use nalgebra::{DMatrix, DVector};
use serde::Deserialize;
use starlings_models_core::exponential::exponential;
use starlings_models_core::integrate::{Solver, Tolerance};
use starlings_models_core::oscillation::driven_motion;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, Quantity, Role, SetupError, Spec, layout};

/// `[model.layout]` of the nozzle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Where the actuator's force comes from.
    pub actuator: Actuator,
}

/// Where the actuator's force comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Actuator {
    /// It is an input, as telemetry gives it.
    #[default]
    Measured,
    /// It holds the nozzle: F = −(K_p φ + K_d φ')/l, with a lag.
    Law,
}

/// J φ'' + B φ' + K φ = l F + s Q (Smelyanskiy, Luchinsky et al., eqs. 1.46 and 1.47).
///
/// φ is the angle of the nozzle, F the actuator's force at the arm l, Q the torque, of which the parameter `severity` s takes a multiple.
/// With the law of the actuator τ F' = −(K_p φ + K_d φ')/l − F. States are φ, φ' and then F.
pub struct ThrustVectorControl {
    spec: Spec,
    actuator: Actuator,
}

fn parameters(actuator: Actuator) -> Vec<Quantity> {
    let value = |name: &str, unit: &str, role: Role, default: f64, says: &str| {
        Quantity::new(name, unit).role(role).positive().default(default).says(says)
    };
    let mut parameters = vec![
        value("J", "kg m^2", Role::Inertia, 4000.0, "Moment of inertia of the nozzle about its pivot."),
        value("B", "N m s", Role::Damping, 4e4, "Viscous damping of the joint.").range(0.0, f64::INFINITY),
        value("K", "N m", Role::Stiffness, 4e6, "Stiffness of the joint, per radian."),
        value("arm", "m", Role::Other, 1.2, "Arm at which the actuator acts."),
        Quantity::new("severity", "").default(1.0).says("Factor on the torque."),
    ];
    if actuator == Actuator::Law {
        parameters.extend([
            value("Kp", "N m", Role::Other, 6e5, "Torque of the actuator per radian.")
                .range(0.0, f64::INFINITY),
            value("Kd", "N m s", Role::Other, 1e4, "Torque of the actuator per rate.")
                .range(0.0, f64::INFINITY),
            value("lag", "s", Role::Other, 0.02, "Time constant of the actuator."),
        ]);
    }
    parameters
}

impl ThrustVectorControl {
    /// The model in a layout.
    pub fn new(layout: Layout) -> Self {
        let Layout { actuator } = layout;
        let force = |name: &str| {
            Quantity::new(name, "N").role(Role::Force).says("Force of the actuator on the nozzle.")
        };
        let angle = |name: &str| {
            Quantity::new(name, "rad").role(Role::Displacement).default(0.0).says("Angle of the nozzle.")
        };
        let rate = |name: &str| {
            Quantity::new(name, "rad/s").role(Role::Velocity).default(0.0).says("Rate of the angle.")
        };
        // An effect on a name that a state has would enter its rate.
        let mut states = vec![angle("phi"), rate("phi_dot")];
        let mut outputs = vec![angle("angle"), rate("rate")];
        let torque =
            Quantity::new("torque", "N m").role(Role::Force).says("Torque on the nozzle about its pivot.");
        let mut inputs = vec![torque];
        match actuator {
            Actuator::Measured => inputs.insert(0, force("actuator_force")),
            Actuator::Law => {
                states.push(force("F").default(0.0));
                outputs.push(force("actuator_force"));
            }
        }
        let measures = outputs.iter().zip(&states).map(|(o, s)| (o.name.clone(), s.name.clone())).collect();
        let spec = Spec {
            kind: "thrust-vector-control".to_owned(),
            says: "A gimballed nozzle held by its actuator, pushed by an unknown torque.".to_owned(),
            measures,
            outputs,
            states,
            parameters: parameters(actuator),
            inputs,
            restart: true,
        };
        Self { spec, actuator }
    }

    /// The model of a study.
    ///
    /// # Errors
    /// When its layout cannot be read.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(layout::read(def)?)))
    }

    /// Torque by the inputs.
    fn torque(&self, theta: &[f64], u: &[f64]) -> f64 {
        let (arm, severity) = (theta[3], theta[4]);
        match self.actuator {
            Actuator::Measured => arm * u[0] + severity * u[1],
            Actuator::Law => severity * u[0],
        }
    }
}

/// The rate of (φ, φ', F) as a matrix, with the law of the actuator.
fn matrix(theta: &[f64]) -> [[f64; 3]; 3] {
    let [j, b, k, arm, kp, kd, lag] = [0, 1, 2, 3, 5, 6, 7].map(|i| theta[i]);
    [[0.0, 1.0, 0.0], [-k / j, -b / j, arm / j], [-kp / (arm * lag), -kd / (arm * lag), -1.0 / lag]]
}

impl Model for ThrustVectorControl {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// At rest.
    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let torque = self.torque(theta, u.value);
        match self.actuator {
            Actuator::Measured => {
                dx[0] = x[1];
                dx[1] = (torque - theta[1] * x[1] - theta[2] * x[0]) / theta[0];
            }
            Actuator::Law => {
                for (dx, row) in dx.iter_mut().zip(matrix(theta)) {
                    *dx = row.iter().zip(x).map(|(a, x)| a * x).sum();
                }
                dx[1] += torque / theta[0];
            }
        }
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y.copy_from_slice(x);
    }

    /// Where an effect asks for integration: angles are milliradians.
    fn solver(&self) -> Solver {
        Solver::Auto(Tolerance { relative: 1e-9, absolute: 1e-13 })
    }

    /// Exact for inputs linear in time: of the law by the exponential of the matrix of (φ, φ', F, 1, t).
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let h = segment.t1 - segment.t0;
        let load = [self.torque(theta, segment.u0), self.torque(theta, segment.slope)];
        match self.actuator {
            Actuator::Measured => x.copy_from_slice(&driven_motion(theta, h, [x[0], x[1]], load)),
            Actuator::Law => {
                let mut rate = DMatrix::zeros(5, 5);
                for (i, row) in matrix(theta).iter().enumerate() {
                    row.iter().enumerate().for_each(|(k, a)| rate[(i, k)] = a * h);
                }
                rate[(1, 3)] = load[0] / theta[0] * h;
                rate[(1, 4)] = load[1] / theta[0] * h * h;
                rate[(4, 3)] = 1.0;
                let start = DVector::from_vec(vec![x[0], x[1], x[2], 1.0, 0.0]);
                x.copy_from_slice((exponential(&rate) * start).rows(0, 3).as_slice());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models_core::advance_by;
    use starlings_models_core::limits::Limits;

    struct NoHistory;
    impl starlings_models_core::segment::History for NoHistory {
        fn at(&self, _: usize, _: f64) -> f64 {
            f64::NAN
        }
    }

    fn model(actuator: Actuator) -> (ThrustVectorControl, Vec<f64>) {
        let model = ThrustVectorControl::new(Layout { actuator });
        let theta = model.spec().parameters.iter().filter_map(|q| q.default).collect();
        (model, theta)
    }

    fn segment<'a>(t1: f64, u0: &'a [f64], slope: &'a [f64], limits: &'a Limits<'a>) -> Segment<'a> {
        Segment { t0: 0.0, t1, u0, slope, history: &NoHistory, limits, noise: None }
    }

    #[test]
    fn a_steady_torque_and_force_turn_the_nozzle_by_their_sum_over_the_stiffness() {
        let (model, theta) = model(Actuator::Measured);
        let mut x = [0.0; 2];
        let limits = Limits::none();
        model.advance(segment(10.0, &[5000.0, 2000.0], &[0.0; 2], &limits), &theta, &mut x).expect("a step");
        // e^(−50) of the oscillation is left.
        assert!((x[0] - (1.2 * 5000.0 + 2000.0) / 4e6).abs() < 1e-16, "{x:?}");
    }

    #[test]
    fn a_steady_torque_is_held_by_the_joint_and_the_actuator() {
        let (model, theta) = model(Actuator::Law);
        let mut x = [0.0; 3];
        let limits = Limits::none();
        model.advance(segment(10.0, &[2000.0], &[0.0], &limits), &theta, &mut x).expect("a step");
        // K + K_p hold it; e^(−50) of the oscillation is left, and rounding of an exponential of norm 1e7.
        assert!((x[0] / (2000.0 / 4.6e6) - 1.0).abs() < 1e-8, "{x:?}");
        assert!((x[2] / (-6e5 / 1.2 * x[0]) - 1.0).abs() < 1e-8, "{x:?}");
    }

    #[test]
    fn the_step_with_the_law_of_the_actuator_agrees_with_its_integrated_rate() {
        let (model, theta) = model(Actuator::Law);
        let start = [0.003, -0.2, 900.0];
        let (mut exact, mut integrated) = (start, start);
        let limits = Limits::none();
        let span = segment(0.3, &[3e4], &[-2e5], &limits);
        model.advance(span, &theta, &mut exact).expect("a step");
        let tolerance = Tolerance { relative: 1e-12, absolute: 1e-14 };
        advance_by(&model, Solver::Dopri5(tolerance), span, &theta, &mut integrated).expect("integrated");
        for (a, b) in exact.iter().zip(integrated) {
            // Some thousand steps of a relative error of 1e-12, of sizes up to 3000.
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{exact:?}, {integrated:?}");
        }
    }
}
