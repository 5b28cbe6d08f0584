//! Schur displacement feedback, coupling u = ḋ: the fluid follows the corrected displacement, so that only the solid's
//! momentum sees the feedback (Moireau, Chapelle & Le Tallec 2009).
//!
//! With the solid's velocity v = dd/dt − γ Ext (z − d), elimination of v gives the error
//! M d²e/dt² + γ Ms Ext de/dt + K e = 0 (potential flow): under full observation this is [`super::dvf`], and added mass
//! defeats it alike. A step moves the displacement alone, in the velocity of the solid's momentum: only with nothing damped and
//! no outlet has it the poles of that equation. It is here to be compared; take [`super::sdf`]. Next file to read:
//! [`super::image_force`].

use nalgebra::DMatrix;

use super::extension::{extension, onto_all};
use super::wall::{Shown, Wall, add, feedback, of_velocity, on_velocity, solve};
use super::{Correction, Kind, Observer, Wiring};
use crate::SetupError;
use crate::setup::ObserverDef;
use crate::{Blocks, Model};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "sdf-displacement",
    says: "Observed wall displacements pull the wall, and the fluid follows the corrected displacement.",
    build: |def, wiring| Ok(Box::new(SolidFeedback::new(def, wiring)?)),
};

/// Feedback of the wall displacement that the solid alone feels.
#[derive(Debug)]
pub(crate) struct SolidFeedback {
    wall: Wall,
}

impl SolidFeedback {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall or its displacement is not observed.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Displacement)? })
    }
}

impl SolidFeedback {
    /// Eᵀ γ Ms Ext, n_c × n, the observed nodes given and `weighed` for the times since each was seen, and the same times E, n_c × n_c.
    fn pull(
        &self,
        blocks: &Blocks,
        observed: &[bool],
        weighed: impl Fn(DMatrix<f64>) -> DMatrix<f64>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let extension = weighed(onto_all(&extension(&blocks.stiffness, observed), observed));
        let trace = blocks.trace.as_ref();
        let force = on_velocity(trace, &blocks.solid_mass * extension * self.wall.gain);
        let damping = of_velocity(trace, force.clone());
        (force, damping)
    }
}

impl Observer for SolidFeedback {
    /// δd = (1 + γΔt G)⁻¹ γΔt G (z − d), G = E M⁻¹ Eᵀ Ms Ext: the implicit step in the momentum velocity E c = dd/dt − γ G
    /// (z − d), stable at any gain. Its poles are those of [`Observer::feedback`], which is written in the velocity dd/dt,
    /// only with nothing damped and no outlet: a damping force takes E c for the velocity here, dd/dt there. Solved as
    /// (M + γΔt Eᵀ Ms Ext E) y = γΔt Eᵀ Ms Ext (z − d), δd = E y.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let (force, damping) =
            self.pull(&blocks, &innovation.observed, |extension| innovation.by_node(extension));
        let longest = innovation.longest();
        let system = blocks.mass + damping * longest;
        let Some(change) = system.lu().solve(&(force * innovation.column() * longest)) else {
            // The run reports a state that is not a number.
            x.fill(f64::NAN);
            return;
        };
        match &blocks.trace {
            Some(trace) => add(x, self.wall.displacement, (trace * change).as_slice()),
            None => add(x, self.wall.displacement, change.as_slice()),
        }
    }

    fn reads(&self) -> Vec<usize> {
        self.wall.reads()
    }

    /// Γ on the velocity: γ M⁻¹ Eᵀ Ms Ext E.
    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let (_, damping) = self.pull(&blocks, &self.wall.observed(), |extension| extension);
        feedback(model, (self.wall.velocity, self.wall.velocity), &solve(blocks.mass, damping))
    }

    fn note(&self) -> Option<&'static str> {
        Some("of the feedback on dd/dt; corrections have these poles only with nothing damped and no outlet")
    }
}
