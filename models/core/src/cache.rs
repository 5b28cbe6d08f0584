//! What was computed for the last few sets of values, kept: the same values always give the same bits, computed or kept.
//!
//! Next file to read: [`crate::exponential`].

use std::sync::{Arc, Mutex, PoisonError};

/// Sets of values that are kept at most; more than the runs that share a model at one time.
const KEPT: usize = 8;

/// A value and the numbers that it was computed from, bit by bit.
type Entry<T> = (Vec<u64>, Arc<T>);

/// The last few results of a costly computation, by the bits of what it was computed from.
pub struct Cache<T> {
    entries: Mutex<Vec<Entry<T>>>,
}

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Self { entries: Mutex::new(Vec::new()) }
    }
}

impl<T> Cache<T> {
    /// The result for these numbers, computed by `make` when it is not kept.
    pub fn get(&self, from: &[f64], make: impl FnOnce() -> T) -> Arc<T> {
        let same = |entry: &Entry<T>| entry.0.iter().copied().eq(from.iter().map(|v| v.to_bits()));
        if let Some(found) = self.entries().iter().rev().find(|entry| same(entry)) {
            return Arc::clone(&found.1);
        }
        // Computed without the lock: two runs that compute the same lose time and nothing else.
        let made = Arc::new(make());
        let mut entries = self.entries();
        if entries.len() == KEPT {
            entries.remove(0);
        }
        entries.push((from.iter().map(|v| v.to_bits()).collect(), Arc::clone(&made)));
        made
    }

    fn entries(&self) -> std::sync::MutexGuard<'_, Vec<Entry<T>>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]

    use super::*;

    #[test]
    fn a_result_is_computed_once_while_it_is_kept_and_again_after() {
        let (cache, computed) = (Cache::default(), std::cell::Cell::new(0));
        let ask = |value: f64| {
            *cache.get(&[value, 1.0], || {
                computed.set(computed.get() + 1);
                2.0 * value
            })
        };
        assert_eq!([ask(3.0), ask(3.0), ask(3.0)], [6.0; 3]);
        assert_eq!(computed.get(), 1);
        (0..KEPT).for_each(|i| assert!(ask(i as f64 + 10.0) > 0.0));
        assert_eq!((ask(3.0), computed.get()), (6.0, 2 + KEPT));
    }
}
