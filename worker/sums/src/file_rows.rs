//! Rows of a recording out of the bytes of its file.
//!
//! Only plain text is taken: numbers separated by commas, one row per line, no quotes and no empty line. Anything else is left to whoever
//! reads the file from its start and can say what is wrong in which line; so nothing is explained here. Next file to read:
//! [`super::block_sums`].

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::time::UNIX_EPOCH;

use starlings_models::SumsFile;

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

/// Bytes that are read behind a part at first, for the rows beyond it.
const BEHIND: u64 = 1 << 12;

/// Length of a file and when it was last changed, nanoseconds since 1970; `None` where the system does not say.
pub fn stamp(file: &File) -> Option<(u64, u64)> {
    let metadata = file.metadata().ok()?;
    let modified = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some((metadata.len(), u64::try_from(modified.as_nanos()).ok()?))
}

/// Times, and values row after row, of those bytes; `None` where they are no plain rows or the file is another one.
pub(crate) fn read(def: &SumsFile, bytes: Bytes) -> Option<(Vec<f64>, Vec<f64>)> {
    let end = bytes.start.checked_add(bytes.length)?;
    if end > def.length {
        return None;
    }
    let mut file = File::open(&def.path).ok()?;
    let described = (def.length, def.modified);
    if stamp(&file)? != described {
        return None;
    }
    let mut text = vec![0; usize::try_from(bytes.length).ok()?];
    file.seek(SeekFrom::Start(bytes.start)).ok()?;
    file.read_exact(&mut text).ok()?;
    let rows = parse(&text, def, bytes.n_row)?;
    // A file that was written to meanwhile is another one.
    (stamp(&file)? == described).then_some(rows)
}

/// Steps that start in a part of the file, and times and values of its rows as [`read`] gives them; `None` as there, or where no step starts
/// in it.
pub(crate) fn read_part(def: &SumsFile, part: Part) -> Option<(usize, Vec<f64>, Vec<f64>)> {
    let mut file = File::open(&def.path).ok()?;
    let described = (def.length, def.modified);
    if stamp(&file)? != described {
        return None;
    }
    let mut behind = BEHIND;
    loop {
        // Two bytes before it may end the line before its first row.
        let begin = part.from.saturating_sub(2);
        let end = part.to.saturating_add(behind).min(def.length);
        let mut text = vec![0; usize::try_from(end.checked_sub(begin)?).ok()?];
        file.seek(SeekFrom::Start(begin)).ok()?;
        file.read_exact(&mut text).ok()?;
        let Some(of) = lines_of(&text, begin, part, end == def.length) else {
            if end == def.length {
                return None;
            }
            behind *= 8;
            continue;
        };
        let (times, rows) = parse(&text[of.start..of.end], def, of.n_row)?;
        // A file that was written to meanwhile is another one.
        return (stamp(&file)? == described && of.n_step > 0).then_some((of.n_step, times, rows));
    }
}

/// The lines of a part in a text.
struct Lines {
    start: usize,
    end: usize,
    n_row: usize,
    n_step: usize,
}

/// Where the lines of a part are in a text that begins at a byte of the file; `None` where the text ends before they do.
fn lines_of(text: &[u8], begin: u64, part: Part, is_end: bool) -> Option<Lines> {
    let (mut start, mut n_row, mut n_in) = (None, 0, 0);
    for at in memchr::memchr_iter(b'\n', text) {
        // The line behind this end begins, as it is counted, behind the first of its bytes.
        let after_return = at > 0 && text[at - 1] == b'\r';
        let row = begin + at as u64 + u64::from(!after_return);
        if row < part.from {
            continue;
        }
        // Rows behind the part have begun, and this ends the last of them.
        if n_row > n_in + part.ahead {
            return Some(Lines { start: start?, end: at + 1, n_row, n_step: n_in });
        }
        if at + 1 < text.len() {
            start.get_or_insert(at + 1);
            n_row += 1;
            n_in += usize::from(row < part.to);
        }
    }
    if !is_end {
        return None;
    }
    // At the end of the file the last row ends the last step.
    Some(Lines { start: start?, end: text.len(), n_row, n_step: n_in.min(n_row.checked_sub(1)?) })
}

/// The rows of a text.
fn parse(text: &[u8], def: &SumsFile, n_row: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    if n_row > text.len() || memchr::memchr(b'"', text).is_some() {
        return None;
    }
    let (time, channels) = def.cells.split_first()?;
    let wanted: Vec<bool> = (0..def.n_cell).map(|k| def.cells.contains(&k)).collect();
    let mut values = vec![0.0; def.n_cell];
    let mut times = Vec::with_capacity(n_row);
    let mut rows = Vec::with_capacity(n_row.checked_mul(channels.len())?);
    let mut rest = text;
    while !rest.is_empty() {
        let used = row(rest, &wanted, &mut values)?;
        rest = &rest[used..];
        times.push(*values.get(*time)?);
        for at in channels {
            rows.push(*values.get(*at)?);
        }
    }
    (times.len() == n_row).then_some((times, rows))
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
mod tests {
    use super::*;

    fn def(n_cell: usize, cells: &[usize]) -> SumsFile {
        SumsFile { n_cell, cells: cells.to_vec(), ..SumsFile::default() }
    }

    #[test]
    fn plain_rows_are_read_in_the_order_of_the_columns() {
        let expected = Some((vec![0.5, 0.75], vec![3.0, -1e-3, 4.0, 2.0]));
        for text in ["a,-1e-3,0.5,3\nb,2,.75,+4.\n", " , -1e-3 ,\t0.5,3\r\n,2,0.75,4"] {
            assert_eq!(parse(text.as_bytes(), &def(4, &[2, 3, 1]), 2), expected, "{text:?}");
        }
    }

    #[test]
    fn what_is_not_plain_is_left_to_others() {
        let wrong = [
            "0,1\n1,2\n2,3\n", // more rows
            "0,1\n",           // fewer
            "0,1\n\n1,2\n",    // an empty line
            "0,1\n1\n",
            "0,1\n1,2,3\n",
            "0,1\n1,\n",
            "0,1\n1,x\n",
            "0,1\n1,inf\n",
            "0,1\n1,NaN\n",
            "0,1\n1,\"2\"\n",
            "0,1\r1,2\n2,3", // a line that ends otherwise
            "0,1\n1,\u{e4}2\n",
            "0,1\n1,2e\n",
            "0,1\n1,1_0\n",
            "0,1\n1,0x1\n",
            "0,1\n1,1e999\n",
            "0,1\n\r\n",
        ];
        for text in wrong {
            assert_eq!(parse(text.as_bytes(), &def(2, &[0, 1]), 2), None, "{text:?}");
        }
        assert!(parse(b"0,1\n1,2\n", &def(2, &[0, 1]), 2).is_some());
        assert_eq!(parse(b"0,1\n1,2\n", &def(2, &[0, 2]), 2), None, "a position that no row has");
        assert_eq!(parse(b"\n\n", &def(1, &[]), 2), None, "no time");
        assert_eq!(parse(b"1\n\n", &def(1, &[0]), 2), None);
    }

    #[test]
    fn numbers_have_the_bits_of_the_standard_library() {
        let mut state = 1_u64;
        for k in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let bits = f64::from_bits(state);
            let value = if k % 2 == 0 { (state >> 11) as f64 * 1e-12 - 4.0 } else { bits };
            if value.is_finite() {
                for text in [format!("{value:?},{value}"), format!("{value:e},{value:.3e}")] {
                    let expected: Vec<f64> = text.split(',').filter_map(|cell| cell.parse().ok()).collect();
                    let found = parse(text.as_bytes(), &def(2, &[0, 1]), 1);
                    let found = found.map(|(times, rows)| [times, rows].concat()).unwrap_or_default();
                    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                    assert_eq!(bits(&found), bits(&expected), "{text}");
                }
            }
        }
    }

    #[test]
    fn a_file_that_was_changed_is_not_read() {
        let dir = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let path = dir.path().join("rows.csv");
        std::fs::write(&path, "t,x\n0,1\n1,2\n").unwrap_or_else(|error| panic!("{error}"));
        let open = || File::open(&path).unwrap_or_else(|error| panic!("{error}"));
        let (length, modified) = stamp(&open()).unwrap_or_default();
        let path = path.display().to_string();
        let file = SumsFile { path, length, modified, ..def(2, &[0, 1]) };
        let all = Bytes { start: 4, length: 8, n_row: 2 };
        assert_eq!(read(&file, all), Some((vec![0.0, 1.0], vec![1.0, 2.0])));
        assert_eq!(read(&file, Bytes { length: 9, ..all }), None, "beyond its end");
        assert_eq!(read(&file, Bytes { start: u64::MAX, ..all }), None);
        assert_eq!(read(&SumsFile { length: length - 1, ..file.clone() }, all), None);
        assert_eq!(read(&SumsFile { modified: modified + 1, ..file }, all), None);
    }
}
