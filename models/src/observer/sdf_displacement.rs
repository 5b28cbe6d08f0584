//! Schur displacement feedback, coupling u = ḋ: the fluid follows the corrected displacement, so that only the solid's
//! momentum sees the feedback (Moireau, Chapelle & Le Tallec 2009).
//!
//! With the solid's velocity v = dd/dt − γ Ext (z − d), elimination of v gives the error
//! M d²e/dt² + γ Eᵀ Ms Ext de/dt + K e = 0: under full observation this is [`super::dvf`], and added mass defeats it alike.
//! It is here to be compared; take [`super::sdf`]. Next file to read: [`super::image_force`].

use nalgebra::DMatrix;

use super::extension::{extension, onto_all, seen};
use super::wall::{Shown, Wall, add, feedback, of_velocity, on_velocity, solve};
use super::{Correction, Kind, Observer, Wiring};
use crate::setup::{ObserverDef, SetupError};
use crate::{Blocks, Model};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "sdf-displacement",
    says: "Observed wall displacements pull the wall, and the fluid follows the corrected displacement.",
    build: |def, wiring| Ok(Box::new(SolidFeedback::new(def, wiring)?)),
};

/// Feedback of the wall displacement that the solid alone feels.
#[derive(Debug)]
pub struct SolidFeedback {
    wall: Wall,
}

impl SolidFeedback {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall or its displacement is not observed.
    pub fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Displacement)? })
    }
}

/// Eᵀ Ms P, n_c × n_observed: the solid's momentum in the extension of each observed node's displacement.
fn momentum(blocks: &Blocks, observed: &[bool]) -> DMatrix<f64> {
    on_velocity(blocks.trace.as_ref(), &blocks.solid_mass * extension(&blocks.stiffness, observed))
}

impl Observer for SolidFeedback {
    /// δd = (1 + γΔt G)⁻¹ γΔt G (z − d), G = E M⁻¹ Eᵀ Ms Ext: the implicit step in the momentum velocity E c = dd/dt − γ G
    /// (z − d), stable at any gain. Its poles are those of [`Observer::feedback`], which is written in the velocity dd/dt,
    /// where the fluid is not damped. The system is solved for what the step leaves of the innovation on observed nodes.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let observed = &innovation.observed;
        let momentum = momentum(&blocks, observed) * (self.wall.gain * at.dt);
        let velocity = solve(blocks.mass, momentum);
        let wall = match &blocks.trace {
            Some(trace) => trace * velocity,
            None => velocity,
        };
        let nodes: Vec<usize> = (0..observed.len()).filter(|node| observed[*node]).collect();
        let mut system = wall.select_rows(&nodes);
        for i in 0..nodes.len() {
            system[(i, i)] += 1.0;
        }
        let start = seen(innovation.value.as_slice(), observed);
        match system.lu().solve(&DMatrix::from_vec(nodes.len(), 1, start)) {
            Some(left) => add(x, self.wall.displacement, (wall * left).as_slice()),
            None => x.fill(f64::NAN),
        }
    }

    /// Γ on the velocity: γ M⁻¹ Eᵀ Ms Ext E.
    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let observed = self.wall.observed();
        let momentum = onto_all(&momentum(&blocks, &observed), &observed) * self.wall.gain;
        let block = solve(blocks.mass, of_velocity(blocks.trace.as_ref(), momentum));
        feedback(model, (self.wall.velocity, self.wall.velocity), &block)
    }
}
