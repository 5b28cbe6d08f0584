//! Several observers in one run, such as one of the wall beside that of the Windkessel behind it.
//!
//! Each corrects states of its own with the innovations of one prediction, so that their order does not matter. With Γ₁ and Γ₂ the
//! error obeys de/dt = (A − Γ₁ − Γ₂) e, whose poles are not those of either alone. Next file to read: [`crate::spectrum`].

use nalgebra::DMatrix;

use super::{Correction, Observer, Wiring, one};
use crate::setup::ObserverDef;
use crate::{Model, SetupError};

/// Observers side by side.
pub(crate) struct Together {
    members: Vec<Box<dyn Observer>>,
}

impl Together {
    /// Builds each of them.
    ///
    /// # Errors
    /// As each alone.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        Ok(Self { members: def.all().map(|def| one(def, wiring)).collect::<Result<_, _>>()? })
    }
}

impl Observer for Together {
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        for member in &self.members {
            member.correct(at, x);
        }
    }

    fn reads(&self) -> Vec<usize> {
        self.members.iter().flat_map(|member| member.reads()).collect()
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        self.members.iter().fold(DMatrix::zeros(n, n), |sum, member| sum + member.feedback(model, theta))
    }

    fn note(&self) -> Option<&'static str> {
        self.members.iter().find_map(|member| member.note())
    }
}

/// The first two of several observers that correct one state, and that state: their positions, and the position in the state.
pub fn shared_state(
    observers: &[Box<dyn Observer>],
    model: &dyn Model,
    theta: &[f64],
) -> Option<(usize, usize, usize)> {
    let corrected = observers.iter().map(|observer| {
        let feedback = observer.feedback(model, theta);
        feedback.row_iter().map(|row| row.iter().any(|entry| *entry != 0.0)).collect::<Vec<bool>>()
    });
    let corrected: Vec<Vec<bool>> = corrected.collect();
    for (j, second) in corrected.iter().enumerate() {
        for (i, first) in corrected[..j].iter().enumerate() {
            if let Some(state) = first.iter().zip(second).position(|(a, b)| *a && *b) {
                return Some((i, j, state));
            }
        }
    }
    None
}
