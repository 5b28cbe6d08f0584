//! No observer: the state runs free. Next file to read: [`super::nudging`].

use nalgebra::DMatrix;

use super::{Correction, Kind, Observer};
use crate::Model;

/// Leaves the state as it is.
pub(crate) struct NoObserver;

/// The entry of the observer list.
pub(super) const KIND: Kind =
    Kind { kind: "none", says: "The state runs free.", build: |_, _| Ok(Box::new(NoObserver)) };

impl Observer for NoObserver {
    fn correct(&self, _at: Correction<'_>, _x: &mut [f64]) {}

    fn reads(&self) -> Vec<usize> {
        Vec::new()
    }

    fn feedback(&self, model: &dyn Model, _theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        DMatrix::zeros(n, n)
    }
}
