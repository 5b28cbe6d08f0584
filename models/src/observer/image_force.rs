//! Image force: the observed displacement pulls the wall like a spring (Sermesant et al. 2006, for cardiac images).
//!
//! M dc/dt + D c + Eᵀ K d = loads + γ² Eᵀ H Ms H (z − d). The error gains stiffness and no damping: its frequencies shift and
//! its amplitude stays. It is here to be compared; take [`super::sdf`]. Next file to read: [`super::windkessel`].

use nalgebra::DMatrix;

use super::wall::{Shown, Wall, add, feedback, on_velocity, restricted, solve};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::setup::{ObserverDef, SetupError};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "image-force",
    says: "Observed wall displacements pull the wall like springs: frequencies shift, nothing decays.",
    build: |def, wiring| Ok(Box::new(ImageForce::new(def, wiring)?)),
};

/// A spring between the wall and its image.
#[derive(Debug)]
pub struct ImageForce {
    wall: Wall,
}

impl ImageForce {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall or its displacement is not observed.
    pub fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Displacement)? })
    }

    /// Eᵀ H Ms H, n_c × n, the observed nodes given.
    fn spring(blocks: &crate::Blocks, observed: &[bool]) -> DMatrix<f64> {
        on_velocity(blocks.trace.as_ref(), restricted(blocks.solid_mass.clone(), observed))
    }
}

impl Observer for ImageForce {
    /// δc = Δt γ² M⁻¹ Eᵀ H Ms H (z − d): the impulse of the force over Δt.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let force = Self::spring(&blocks, &innovation.observed) * innovation.column();
        let change = solve(blocks.mass, force) * (at.dt * self.wall.gain * self.wall.gain);
        add(x, self.wall.velocity, change.as_slice());
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let spring = Self::spring(&blocks, &self.wall.observed()) * (self.wall.gain * self.wall.gain);
        feedback(model, (self.wall.velocity, self.wall.displacement), &solve(blocks.mass, spring))
    }

    /// An impulse and a drift repeat stably while γΔt < 2 √(largest eigenvalue of Ms⁻¹ M), which is at least 2. A wave of
    /// circular frequency ω, as stiff as it comes, asks for ωΔt well below π besides.
    fn stable_up_to(&self) -> Option<f64> {
        Some(2.0)
    }
}
