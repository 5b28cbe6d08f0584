//! A file's lines in pieces that stay in a processor's own cache: a whole block of them would pass through memory several times.
//!
//! Next file to read: [`super::file_rows`], which makes rows of them.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

/// Bytes that are read at a time.
const PIECE: usize = 1 << 16;
/// Bytes of a line at most.
const LONGEST: usize = 1 << 24;

/// Bytes of a file from a place on, in pieces that end where a line does.
pub(crate) struct Pieces {
    file: File,
    /// Its first `held` bytes are of the file; those before `from` were given out.
    text: Vec<u8>,
    from: usize,
    held: usize,
    /// Bytes of the file that are still to be read.
    left: u64,
}

impl Pieces {
    /// The bytes `from..to` of a file; `None` where it has no such place.
    pub(crate) fn new(mut file: File, from: u64, to: u64) -> Option<Self> {
        let left = to.checked_sub(from)?;
        file.seek(SeekFrom::Start(from)).ok()?;
        Some(Self { file, text: Vec::new(), from: 0, held: 0, left })
    }

    /// The next piece: whole lines with their ends, the last of all perhaps without; empty behind that. `None` where the file cannot be
    /// read, ends sooner, or has a line that is too long.
    pub(crate) fn next(&mut self) -> Option<&[u8]> {
        self.text.copy_within(self.from..self.held, 0);
        (self.held, self.from) = (self.held - self.from, 0);
        loop {
            let at = self.held;
            if at + PIECE > LONGEST {
                return None;
            }
            let more = self.left.min(PIECE as u64) as usize;
            if self.text.len() < at + more {
                self.text.resize(at + more, 0);
            }
            let read = &mut self.text[at..at + more];
            self.file.read_exact(read).ok()?;
            let line_end = memchr::memrchr(b'\n', read);
            self.held += more;
            self.left -= more as u64;
            self.from = match line_end {
                Some(end) if self.left > 0 => at + end + 1,
                _ if self.left == 0 => self.held,
                _ => continue,
            };
            return Some(&self.text[..self.from]);
        }
    }

    /// The file, to ask whether it is still the same.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn pieces(text: &[u8], from: u64, to: u64) -> Pieces {
        let mut file = tempfile::tempfile().unwrap_or_else(|error| panic!("{error}"));
        file.write_all(text).unwrap_or_else(|error| panic!("{error}"));
        Pieces::new(file, from, to).unwrap_or_else(|| panic!("from {from}"))
    }

    #[test]
    fn pieces_end_with_lines_and_hold_every_byte_once() {
        let line = |k: usize| format!("{}\n", "x".repeat(1 + k * k % 977)).into_bytes();
        let long = [vec![b'y'; 3 * PIECE], vec![b'\n']].concat();
        let mut text: Vec<u8> = (0..1000).flat_map(line).collect();
        text.extend(long);
        text.extend((0..300).flat_map(line));
        for end in [text.len(), text.len() - 1, text.len() - 200] {
            let (mut all, mut found) = (Vec::new(), pieces(&text, 5, end as u64));
            loop {
                let piece = found.next().unwrap_or_else(|| panic!("up to {end}"));
                all.extend_from_slice(piece);
                match piece {
                    [] => break,
                    piece => assert!(piece.ends_with(b"\n") || all.len() == end - 5),
                }
            }
            assert!(all == text[5..end]);
        }
    }

    #[test]
    fn what_cannot_be_read_is_no_piece() {
        assert!(pieces(b"1\n2\n", 0, 5).next().is_none(), "more than there is");
        let endless = vec![b'x'; LONGEST + 1];
        assert!(pieces(&endless, 0, endless.len() as u64).next().is_none());
        assert!(pieces(b"1\n", 2, 2).next().is_some_and(<[u8]>::is_empty));
    }
}
