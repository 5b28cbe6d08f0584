//! Memory of large states that are no longer needed, for those that come.
//!
//! Memory that the system gives anew is cleared first, which costs as much as the way of a state through the network.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Memory that is kept, bytes at most.
const KEPT: usize = 64 * 1024 * 1024;

/// Buffers of one session.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spare(Arc<Mutex<Vec<Vec<f64>>>>);

impl Spare {
    /// A vector with memory where there is some, and whatever was left in it: to empty it costs what filling it again does.
    pub(crate) fn take(&self) -> Vec<f64> {
        self.lock().pop().unwrap_or_default()
    }

    /// Keeps the memory of a vector, unless there is enough.
    pub(crate) fn give(&self, values: Vec<f64>) {
        let mut kept = self.lock();
        let bytes = 8 * (kept.iter().map(Vec::capacity).sum::<usize>() + values.capacity());
        if values.capacity() > 0 && bytes <= KEPT {
            kept.push(values);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Vec<f64>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_used_again_and_bounded() {
        let spare = Spare::default();
        for _ in 0..5 {
            spare.give(vec![1.0; KEPT / 16]);
        }
        spare.give(Vec::new());
        assert_eq!(spare.lock().len(), 2);
        let again = spare.take();
        assert!(again.capacity() >= KEPT / 16);
        spare.give(vec![0.0; KEPT]);
        assert_eq!(spare.lock().len(), 1, "one that is too large is not kept");
    }
}
