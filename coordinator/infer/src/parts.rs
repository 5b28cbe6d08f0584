//! Parts of a file of about the same number of bytes: blocks that are known without reading it.
//!
//! A row belongs to the part in which it begins, as the reader of CSV counts: behind the first byte of the line end before it. The last part is
//! between a half and one and a half of the others, so that it holds steps. Next file to read: `blocks.rs`.

/// How a file is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Parts {
    /// Where its first row begins.
    first: u64,
    /// Bytes of a part.
    bytes: u64,
    /// How many.
    pub(crate) n: u64,
}

impl Parts {
    /// The parts of a file of so many bytes, whose first row begins at `first`.
    pub(crate) fn new(first: u64, length: u64, bytes: u64) -> Self {
        let n = (length.saturating_sub(first) + bytes / 2) / bytes;
        Self { first, bytes, n: n.max(1) }
    }

    /// The part of a row that begins at this byte.
    pub(crate) fn of(&self, byte: u64) -> u64 {
        (byte.saturating_sub(self.first) / self.bytes).min(self.n - 1)
    }

    /// First byte of a part, and the first behind it; the last part ends with the file, whose length is given.
    pub(crate) fn range(&self, part: u64, length: u64) -> [u64; 2] {
        let from = self.first + part * self.bytes;
        [from, if part + 1 == self.n { length } else { from + self.bytes }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_meet_and_every_row_is_in_the_one_whose_range_it_begins_in() {
        for length in [10, 11, 60, 149, 150, 151, 1000] {
            let parts = Parts::new(10, length, 100);
            let mut next = 10;
            for part in 0..parts.n {
                let [from, to] = parts.range(part, length);
                assert_eq!(from, next, "part {part} of {length}");
                assert!((from..to).all(|byte| parts.of(byte) == part), "part {part} of {length}");
                next = to;
            }
            assert_eq!(next, length);
            let [from, to] = parts.range(parts.n - 1, length);
            assert!(parts.n == 1 || (50..150).contains(&(to - from)), "{length}");
        }
    }
}
