//! Displacement feedback on a wall without inertia: the observed radius pulls the section of the vessel.
//!
//! With A = πR² and the displacement d = R − R0, dR/dt = … + γ (z − d): that is [`super::sdf`] where the wall has neither mass of its
//! own nor coupling between its rings, so that the extension to rings that are not observed is zero. Next file to read: [`super::sdf`].

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::measured::mean_innovation;
use super::wall::{components, names_no_states};
use super::{Correction, Observer, Wiring};
use crate::blocks::Sections;
use crate::setup::ObserverDef;
use crate::{Model, SetupError};

/// Feedback of the displacement on the section.
#[derive(Debug)]
pub(crate) struct SectionFeedback {
    gain: f64,
    /// Position of the first section in the state.
    area: usize,
    /// Per section the observed rows that show its radius.
    rows: Vec<Vec<usize>>,
}

impl SectionFeedback {
    /// Finds the observed rings.
    ///
    /// # Errors
    /// When the displacement is not observed, or the definition says what is corrected.
    pub(crate) fn new(
        def: &ObserverDef,
        wiring: &Wiring<'_>,
        sections: &Sections,
    ) -> Result<Self, SetupError> {
        names_no_states(def)?;
        let mut rows = vec![Vec::new(); sections.n];
        for (row, ring) in components(wiring, sections.displacement)? {
            rows[ring].push(row);
        }
        if rows.iter().all(Vec::is_empty) {
            return Err(SetupError::Invalid(format!(
                "the observer `{}` needs the output `{field}` observed, and no channel has it: add a channel with `output = \"{field}\"`, \
                 or with some of its components",
                def.kind,
                field = sections.displacement
            )));
        }
        Ok(Self { gain: def.gain, area: sections.area, rows })
    }
}

impl Observer for SectionFeedback {
    /// δR = (1 − e^(−γΔt)) (z − d) on observed rings: exact for a held model, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        for (area, rows) in x[self.area..].iter_mut().zip(&self.rows) {
            if let Some((innovation, span)) = mean_innovation(&at, rows) {
                let pull = -(-self.gain * span).exp_m1();
                let radius = (*area / PI).sqrt();
                // A vessel without a section left is the model's to refuse.
                let change = (pull * innovation).max(-radius);
                // π(R + δR)² − πR², so that no innovation moves nothing, to the bit.
                *area += PI * change * (2.0 * radius + change);
            }
        }
    }

    fn reads(&self) -> Vec<usize> {
        self.rows.iter().flatten().copied().collect()
    }

    /// γ on every observed section: an error of R is one of A over 2πR, and one of d.
    fn feedback(&self, model: &dyn Model, _theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let mut feedback = DMatrix::zeros(n, n);
        for (ring, _) in self.rows.iter().enumerate().filter(|(_, rows)| !rows.is_empty()) {
            feedback[(self.area + ring, self.area + ring)] = self.gain;
        }
        feedback
    }
}
