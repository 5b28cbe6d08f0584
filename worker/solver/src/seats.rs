//! Numbers for programs that run at the same time, by which each finds its cores.
//!
//! Next file to read: [`super::machine`].

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// The numbers in use.
#[derive(Clone, Default)]
pub(crate) struct Seats(Arc<Mutex<BTreeSet<usize>>>);

/// A number until it is dropped.
pub(crate) struct Seat {
    seats: Seats,
    number: usize,
}

impl Seats {
    /// The smallest number that is free.
    pub(crate) fn take(&self) -> Seat {
        let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let number = (0..=taken.len()).find(|number| !taken.contains(number)).unwrap_or_default();
        taken.insert(number);
        Seat { seats: self.clone(), number }
    }
}

impl Seat {
    pub(crate) fn number(&self) -> usize {
        self.number
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.seats.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_free_again_when_its_program_is_done() {
        let seats = Seats::default();
        let (first, second) = (seats.take(), seats.take());
        assert_eq!((first.number(), second.number()), (0, 1));
        drop(first);
        assert_eq!(seats.take().number(), 0);
    }
}
