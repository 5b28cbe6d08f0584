//! No observer: the state runs free. Next file to read: [`super::nudging`].

use super::{Correction, Kind, Observer};

/// Leaves the state as it is.
pub struct NoObserver;

/// The entry of the observer list.
pub(super) const KIND: Kind =
    Kind { kind: "none", says: "The state runs free.", build: |_, _| Ok(Box::new(NoObserver)) };

impl Observer for NoObserver {
    fn correct(&self, _at: Correction<'_>, _x: &mut [f64]) {}
}
