//! The layout of a motor along its bore as a study writes it.
//!
//! Next file to read: [`super::quantities`].

use serde::Deserialize;
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use crate::throat::Throat;

use super::faults::Fault;

/// What the study chooses.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Layout {
    /// Number of cells along the bore.
    pub(super) cells: usize,
    /// The course of the throat's area.
    pub(super) throat: Throat,
    /// Faults along the bore.
    pub(super) faults: Vec<Fault>,
}

/// Cells at most.
const MOST_CELLS: usize = 10_000;

impl Default for Layout {
    fn default() -> Self {
        Self { cells: 20, throat: Throat::Steady, faults: Vec::new() }
    }
}

impl Layout {
    /// Refuses what no motor can be.
    ///
    /// # Errors
    /// [`SetupError::Layout`] with the place.
    pub(super) fn check(&self) -> Result<(), SetupError> {
        if !(4..=MOST_CELLS).contains(&self.cells) {
            return Err(fault("cells", format!("{} cells: give 4 to {MOST_CELLS}", self.cells)));
        }
        let twice = |i: &usize| self.faults[..*i].contains(&self.faults[*i]);
        match (0..self.faults.len()).find(twice) {
            Some(i) => Err(fault(&format!("faults[{i}]"), "this fault is given twice")),
            None => Ok(()),
        }
    }
}
