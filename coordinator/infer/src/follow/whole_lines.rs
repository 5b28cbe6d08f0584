//! The whole lines of a text that is still written: what no line break has ended yet is left off.
//!
//! Half a number would be a number too. Next file to read: [`super`].

use std::io::{BufRead, BufReader, Read, Result};

/// Gives a text on up to its last line break.
pub(crate) struct WholeLines<R> {
    text: BufReader<R>,
    line: Vec<u8>,
    /// Bytes of the line that were given on.
    given: usize,
    /// Whether the text ended within a line.
    pub(crate) left_off: bool,
}

impl<R: Read> WholeLines<R> {
    pub(crate) fn new(text: R) -> Self {
        Self { text: BufReader::new(text), line: Vec::new(), given: 0, left_off: false }
    }
}

impl<R: Read> Read for WholeLines<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        if self.given == self.line.len() {
            self.line.clear();
            self.given = 0;
            self.text.read_until(b'\n', &mut self.line)?;
            if !self.line.ends_with(b"\n") {
                self.left_off |= !self.line.is_empty();
                self.line.clear();
                return Ok(0);
            }
        }
        let n = into.len().min(self.line.len() - self.given);
        into[..n].copy_from_slice(&self.line[self.given..self.given + n]);
        self.given += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

    use super::*;

    #[test]
    fn a_line_without_its_break_is_left_off() {
        for (text, whole, left_off) in
            [("a\nbc\nd", "a\nbc\n", true), ("a\nbc\n", "a\nbc\n", false), ("a", "", true), ("", "", false)]
        {
            let mut lines = WholeLines::new(text.as_bytes());
            let mut read = String::new();
            lines.read_to_string(&mut read).unwrap();
            assert_eq!((read.as_str(), lines.left_off), (whole, left_off), "{text:?}");
        }
    }
}
