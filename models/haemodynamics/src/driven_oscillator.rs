//! The linear oscillator driven by a force.
//!
//! Next file to read: [`super::fsi_tube`].

use starlings_models_core::segment::Segment;
use starlings_models_core::{Blocks, Drive, Model, ModelFailure, Quantity, Role, Spec};

use super::oscillator::{INITIAL_POSITION, blocks, free_motion, measures, outputs, parameters, states};

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

    /// Exact for a force linear in time: the free motion about the particular solution x = (F − c Ḟ/k)/k, v = Ḟ/k.
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let (damping, stiffness) = (theta[1], theta[2]);
        let h = segment.t1 - segment.t0;
        let v = segment.slope[0] / stiffness;
        let start = (segment.u0[0] - damping * v) / stiffness;
        let [dx, dv] = free_motion(theta, h, [x[0] - start, x[1] - v]);
        x[0] = start + v * h + dx;
        x[1] = v + dv;
        Ok(())
    }
}
