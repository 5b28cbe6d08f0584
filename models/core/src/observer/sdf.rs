//! Schur displacement feedback, coupling v = u: the observed displacement pulls the wall itself, and the fluid follows the
//! velocity of the solid's momentum (Moireau, Chapelle & Le Tallec 2009).
//!
//! dd/dt = E c + γ Ext (z − d), with z the observed displacement and Ext its K-harmonic extension to the unobserved nodes.
//! Every mode decays with γ/2 under full observation, whatever the added mass, and the pressure of a Windkessel is moved
//! along with the volume of the vessel. The printed form γ K_μ⁻¹ Hᵀ M H, K_μ = K + μ Hᵀ M H, needs a factor μ: only
//! γ μ K_μ⁻¹ Hᵀ M H tends to γ Ext for large μ, with γ in 1/time. Next file to read: [`super::sdf_displacement`].

use nalgebra::{DMatrix, DVector};

use super::extension::{extension, onto_all, seen};
use super::sections::SectionFeedback;
use super::wall::{Shown, Wall, add, feedback};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::SetupError;
use crate::setup::ObserverDef;

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "sdf",
    says: "Observed wall displacements pull the whole wall along its own elastic extension.",
    build: |def, wiring| match wiring.model.sections(wiring.theta) {
        Some(sections) => Ok(Box::new(SectionFeedback::new(def, &wiring, &sections)?)),
        None => Ok(Box::new(DisplacementFeedback::new(def, wiring)?)),
    },
};

/// Feedback of the wall displacement on the displacement.
#[derive(Debug)]
pub(crate) struct DisplacementFeedback {
    wall: Wall,
}

impl DisplacementFeedback {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall or its displacement is not observed.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { wall: Wall::new(def, &wiring, Shown::Displacement)? })
    }
}

impl Observer for DisplacementFeedback {
    /// δd = (1 − e^(−γΔt)) Ext (z − d): exact for a held model, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let Some(innovation) = self.wall.innovation(&at) else { return };
        let pulled = innovation
            .value
            .zip_map(&innovation.span, |value, span| value * -(-self.wall.gain * span).exp_m1());
        if innovation.observed.iter().all(|seen| *seen) {
            add(x, self.wall.displacement, pulled.as_slice());
            return;
        }
        let Some(blocks) = at.model.blocks(at.theta) else { return };
        let value = DVector::from_vec(seen(pulled.as_slice(), &innovation.observed));
        let change = extension(&blocks.stiffness, &innovation.observed) * value;
        add(x, self.wall.displacement, change.as_slice());
    }

    fn reads(&self) -> Vec<usize> {
        self.wall.reads()
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let Some(blocks) = model.blocks(theta) else { return DMatrix::zeros(n, n) };
        let observed = self.wall.observed();
        let block = onto_all(&extension(&blocks.stiffness, &observed), &observed) * self.wall.gain;
        feedback(model, (self.wall.displacement, self.wall.displacement), &block)
    }
}
