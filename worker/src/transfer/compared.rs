//! Which states are compared with their names: hashing one takes as long as sealing it.
//!
//! Over a plain connection all are. What TLS proves, and what stays inside this machine, arrives as it was sent: there the first state of each
//! direction is compared, and one in so many. Next file to read: [`super`].

use std::sync::atomic::{AtomicU64, Ordering};

/// Of so many states on a way on which nothing is damaged one is compared.
const ONE_IN: u64 = 64;

/// Whether the next state is compared, by direction.
pub(crate) struct Compared {
    /// Whether what travels arrives as it was sent.
    is_safe: bool,
    came: AtomicU64,
    went: AtomicU64,
}

impl Compared {
    pub(crate) fn new(is_safe: bool) -> Self {
        Self { is_safe, came: AtomicU64::new(0), went: AtomicU64::new(0) }
    }

    /// Whether the state that comes next is.
    pub(super) fn comes(&self) -> bool {
        self.next(&self.came)
    }

    /// Whether the state that goes next is.
    pub(super) fn goes(&self) -> bool {
        self.next(&self.went)
    }

    fn next(&self, count: &AtomicU64) -> bool {
        !self.is_safe || count.fetch_add(1, Ordering::Relaxed).is_multiple_of(ONE_IN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_compared_that_could_be_damaged_and_of_others_the_first_each_way_and_one_in_64() {
        let plain = Compared::new(false);
        assert!((0..130).all(|_| plain.comes() && plain.goes()));
        let safe = Compared::new(true);
        // One comes, one goes, as where runs follow one another.
        let compared: Vec<[bool; 2]> = (0..130).map(|_| [safe.comes(), safe.goes()]).collect();
        for (k, both) in compared.into_iter().enumerate() {
            assert_eq!(both, [k % 64 == 0; 2], "number {k}");
        }
    }
}
