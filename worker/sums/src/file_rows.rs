//! Rows of a recording out of the bytes of its file.
//!
//! Only plain text is taken: numbers separated by commas, one row per line, no quotes and no empty line. Anything else is left to whoever
//! reads the file from its start and can say what is wrong in which line; so nothing is explained here. Next file to read:
//! [`super::block_sums`].

use std::fs::File;
use std::time::UNIX_EPOCH;

use starlings_models::SumsFile;

use crate::pieces::Pieces;

/// Bytes that begin and end at the ends of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bytes {
    /// Where they begin.
    pub start: u64,
    /// How many.
    pub length: u64,
    /// Rows in them.
    pub n_row: usize,
}

/// A part of a file: the rows that begin in it, and those that their steps reach beyond it. A row begins, as the reader of CSV counts, behind
/// the first byte of the line end before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// First byte in which a row of it may begin.
    pub from: u64,
    /// The first byte behind these.
    pub to: u64,
    /// Rows beyond its last step.
    pub ahead: usize,
}

/// Length of a file and when it was last changed, nanoseconds since 1970; `None` where the system does not say.
pub fn stamp(file: &File) -> Option<(u64, u64)> {
    let metadata = file.metadata().ok()?;
    let modified = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some((metadata.len(), u64::try_from(modified.as_nanos()).ok()?))
}

/// Times, and values row after row, of those bytes; `None` where they are no plain rows or the file is another one.
pub(crate) fn read(def: &SumsFile, bytes: Bytes) -> Option<(Vec<f64>, Vec<f64>)> {
    let end = bytes.start.checked_add(bytes.length).filter(|end| *end <= def.length)?;
    let mut pieces = Pieces::new(unchanged(def)?, bytes.start, end)?;
    let mut rows = Rows::new(def, bytes.length)?;
    loop {
        let piece = pieces.next()?;
        if piece.is_empty() {
            break;
        }
        rows.take_all(piece)?;
    }
    // A file that was written to meanwhile is another one.
    (stamp(pieces.file())? == (def.length, def.modified) && rows.times.len() == bytes.n_row)
        .then_some((rows.times, rows.values))
}

/// Steps that start in a part of the file, and times and values of its rows as [`read`] gives them; `None` as there, or where no step starts
/// in it.
pub(crate) fn read_part(def: &SumsFile, part: Part) -> Option<(usize, Vec<f64>, Vec<f64>)> {
    // Two bytes before it may end the line before its first row.
    let mut at = part.from.saturating_sub(2);
    let mut pieces = Pieces::new(unchanged(def)?, at, def.length)?;
    let mut rows = Rows::new(def, part.to.min(def.length).saturating_sub(part.from))?;
    let (mut n_in, mut is_row, mut after_return) = (0, false, false);
    let n_step = 'rows: loop {
        let mut rest = pieces.next()?;
        if rest.is_empty() {
            // At the end of the file the last row ends the last step.
            break n_in.min(rows.times.len().checked_sub(1)?);
        }
        if !is_row {
            // What is before the first row ends with the line.
            let used = memchr::memchr(b'\n', rest)? + 1;
            (is_row, after_return) = (true, used > 1 && rest[used - 2] == b'\r');
            (rest, at) = (&rest[used..], at + used as u64);
        }
        is_plain(rest)?;
        while !rest.is_empty() {
            let begin = at - u64::from(after_return);
            // Rows behind the part have begun, and the last of them has ended.
            if rows.times.len() > n_in + part.ahead {
                break 'rows n_in;
            }
            let used = if begin < part.from {
                memchr::memchr(b'\n', rest).map_or(rest.len(), |end| end + 1)
            } else {
                n_in += usize::from(begin < part.to);
                rows.take(rest)?
            };
            after_return = used > 1 && rest[used - 2] == b'\r';
            (rest, at) = (&rest[used..], at + used as u64);
        }
    };
    // A file that was written to meanwhile is another one.
    (stamp(pieces.file())? == (def.length, def.modified) && n_step > 0).then_some((
        n_step,
        rows.times,
        rows.values,
    ))
}

/// The file, where it is still the one that was described.
fn unchanged(def: &SumsFile) -> Option<File> {
    let file = File::open(&def.path).ok()?;
    (stamp(&file)? == (def.length, def.modified)).then_some(file)
}

/// `None` where there are quotes, in which commas and line ends mean nothing.
fn is_plain(text: &[u8]) -> Option<()> {
    memchr::memchr(b'"', text).is_none().then_some(())
}

/// Rows that were read.
struct Rows<'a> {
    /// Positions of the time and of the channels.
    time: usize,
    channels: &'a [usize],
    /// Which cells are read, and what is in those of a row.
    wanted: Vec<bool>,
    cells: Vec<f64>,
    /// Bytes of all rows, about.
    bytes: usize,
    times: Vec<f64>,
    values: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(def: &'a SumsFile, bytes: u64) -> Option<Self> {
        let (time, channels) = def.cells.split_first()?;
        let wanted: Vec<bool> = (0..def.n_cell).map(|k| def.cells.contains(&k)).collect();
        let cells = vec![0.0; def.n_cell];
        let (bytes, [times, values]) = (usize::try_from(bytes).ok()?, [(); 2].map(|()| Vec::new()));
        Some(Self { time: *time, channels, wanted, cells, bytes, times, values })
    }

    /// Reads all rows of a text.
    fn take_all(&mut self, mut text: &[u8]) -> Option<()> {
        is_plain(text)?;
        while !text.is_empty() {
            text = &text[self.take(text)?..];
        }
        Some(())
    }

    /// Reads the first row of a text and says how many bytes it has.
    fn take(&mut self, text: &[u8]) -> Option<usize> {
        let used = row(text, &self.wanted, &mut self.cells)?;
        if self.times.is_empty() {
            // Somewhat more than there are of this length: memory that grows is taken and given back in every job.
            let n_row = self.bytes / used / 8 * 9 + 16;
            self.times.try_reserve_exact(n_row).ok()?;
            self.values.try_reserve_exact(n_row.checked_mul(self.channels.len())?).ok()?;
        }
        self.times.push(*self.cells.get(self.time)?);
        for at in self.channels {
            self.values.push(*self.cells.get(*at)?);
        }
        Some(used)
    }
}

/// Reads a row and says how many bytes it has with its line end; blanks may stand around a number. `None` where a cell that is wanted is no
/// finite number, or the row has another number of cells.
fn row(text: &[u8], wanted: &[bool], values: &mut [f64]) -> Option<usize> {
    let mut at = 0;
    let n = values.len();
    for (k, (value, wanted)) in values.iter_mut().zip(wanted).enumerate() {
        let rest = &text[at..];
        if *wanted {
            let before = n_blank(rest);
            let (found, used) = fast_float2::parse_partial::<f64, _>(&rest[before..]).ok()?;
            if !found.is_finite() {
                return None;
            }
            *value = found;
            at += before + used + n_blank(&rest[before + used..]);
        } else {
            at += memchr::memchr3(b',', b'\n', b'\r', rest).unwrap_or(rest.len());
        }
        match (text.get(at), k + 1 == n) {
            (Some(b','), false) | (Some(b'\n'), true) => at += 1,
            (None, true) if at > 0 => {}
            (Some(b'\r'), true) if text.get(at + 1) == Some(&b'\n') => at += 2,
            _ => return None,
        }
    }
    // An empty line is no row, as which one cell that nobody wants would be taken.
    (n > 1 || at > 1).then_some(at)
}

/// Blanks at the start of a text.
fn n_blank(text: &[u8]) -> usize {
    text.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count()
}

#[cfg(test)]
mod tests;
