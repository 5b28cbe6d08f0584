//! Slots of cores for programs that run at the same time: the number of a slot says which cores its program is bound to.
//!
//! Next file to read: [`super::machine`].

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// The slots in use.
#[derive(Clone, Default)]
pub(crate) struct CoreSlots(Arc<Mutex<BTreeSet<usize>>>);

/// A slot, in use until it is dropped.
pub(crate) struct CoreSlot {
    core_slots: CoreSlots,
    number: usize,
}

impl CoreSlots {
    /// The free slot with the smallest number.
    pub(crate) fn take(&self) -> CoreSlot {
        let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let number = (0..=taken.len()).find(|number| !taken.contains(number)).unwrap_or_default();
        taken.insert(number);
        CoreSlot { core_slots: self.clone(), number }
    }
}

impl CoreSlot {
    pub(crate) fn number(&self) -> usize {
        self.number
    }
}

impl Drop for CoreSlot {
    fn drop(&mut self) {
        self.core_slots.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_free_again_when_its_program_is_done() {
        let core_slots = CoreSlots::default();
        let (first, second) = (core_slots.take(), core_slots.take());
        assert_eq!((first.number(), second.number()), (0, 1));
        drop(first);
        assert_eq!(core_slots.take().number(), 0);
    }
}
