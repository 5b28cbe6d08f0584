//! The linear oscillator driven by a force.
//!
//! Next file to read: [`super::fsi_tube`].

use starlings_models_core::oscillation::driven_motion;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Blocks, Drive, Model, ModelFailure, Quantity, Role, Spec};

use super::oscillator::{INITIAL_POSITION, blocks, measures, outputs, parameters, states};

/// m d²x/dt² + c dx/dt + k x = F(t), with position x and velocity v as states and outputs.
pub(crate) struct DrivenOscillator {
    spec: Spec,
}

impl Default for DrivenOscillator {
    fn default() -> Self {
        Self {
            spec: Spec {
                kind: "driven-oscillator".to_owned(),
                says: "A mass on a spring with a viscous damper, driven by a force.".to_owned(),
                states: states(),
                parameters: parameters(),
                outputs: outputs(),
                inputs: vec![Quantity::new("force", "N").role(Role::Force).says("Force on the mass.")],
                measures: measures(),
                restart: true,
            },
        }
    }
}

impl Model for DrivenOscillator {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x[0] = INITIAL_POSITION;
        x[1] = 0.0;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let (mass, damping, stiffness) = (theta[0], theta[1], theta[2]);
        dx[0] = x[1];
        dx[1] = (u.value[0] - damping * x[1] - stiffness * x[0]) / mass;
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y.copy_from_slice(x);
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        Some(blocks(theta))
    }

    /// Exact for a force linear in time.
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let load = [segment.u0[0], segment.slope[0]];
        x.copy_from_slice(&driven_motion(theta, segment.t1 - segment.t0, [x[0], x[1]], load));
        Ok(())
    }
}
