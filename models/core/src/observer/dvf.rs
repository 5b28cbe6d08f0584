//! Direct velocity feedback: a damping force on the observed wall (Moireau, Chapelle & Le Tallec 2008).
//!
//! M dc/dt + D c + Eᵀ K d = loads + γ Eᵀ H Ms H (z − E c), with z the observed wall velocity. The error loses energy like a
//! damped wall. A heavy fluid slows it: the force is weighed by the solid mass and moves solid and fluid, so a mode with the
//! share f of added mass decays with γ (1 − f)/2 instead of γ/2; [`super::dvf_am`] weighs by both. Next file to read:
//! [`super::dvf_am`], then [`super::sdf`].

use nalgebra::DMatrix;

use super::wall::{Shown, Wall, add, feedback, of_velocity, on_velocity, restricted, solve};
use super::{Correction, Kind, Observer, Wiring};
use crate::SetupError;
use crate::setup::ObserverDef;
use crate::{Blocks, Model};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "dvf",
    says: "Observed wall velocities damp the error, weighed by the mass of the wall.",
    build: |def, wiring| {
        Ok(Box::new(VelocityFeedback::new(def, wiring, |blocks| blocks.solid_mass.clone())?))
    },
};

/// Feedback of the wall velocity, weighed by a norm N of the wall.
#[derive(Debug)]
pub(crate) struct VelocityFeedback {
    wall: Wall,
    norm: fn(&Blocks) -> DMatrix<f64>,
}

impl VelocityFeedback {
    /// Finds the observed nodes; `norm` gives N, n × n, symmetric positive semidefinite.
    ///
    /// # Errors
    /// When the model has no wall or its velocity is not observed.
    pub(crate) fn new(
        def: &ObserverDef,
        wiring: Wiring<'_>,
        norm: fn(&Blocks) -> DMatrix<f64>,
    ) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Velocity)?, norm })
    }
}

impl Observer for VelocityFeedback {
    /// (M + γΔt Eᵀ H N H E) δc = γΔt Eᵀ H N H (z − E c): the implicit step, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let trace = blocks.trace.as_ref();
        let norm = innovation.weighed(restricted((self.norm)(&blocks), &innovation.observed));
        let pull = norm * (self.wall.gain * innovation.longest());
        let force = on_velocity(trace, &pull * innovation.column());
        let damping = on_velocity(trace, of_velocity(trace, pull));
        let change = solve(blocks.mass + damping, force);
        add(x, self.wall.velocity, change.as_slice());
    }

    fn reads(&self) -> Vec<usize> {
        self.wall.reads()
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let trace = blocks.trace.as_ref();
        let pull = restricted((self.norm)(&blocks), &self.wall.observed()) * self.wall.gain;
        let damping = on_velocity(trace, of_velocity(trace, pull));
        feedback(model, (self.wall.velocity, self.wall.velocity), &solve(blocks.mass, damping))
    }
}
