//! Where the blocks of a recording are in its file, so that workers read and parse them: nothing is read where they are cut by bytes, and ends
//! of lines are counted where the study says how many steps they have.
//!
//! The blocks are those of [`crate::blocks`], row for row. What makes a file less plain than rows of numbers (quotes, empty lines, gaps) is found by
//! whoever parses it. Next file to read: `gather.rs`.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};

use starlings_models::SumsFile;
use starlings_study::infer_choice::InferRecord;
use starlings_sums::{Bytes, stamp};

use crate::blocks::{Cut, open};
use crate::parts::Parts;

/// Bytes whose line ends are counted at a time.
const PORTION: usize = 1 << 14;

/// A recording as workers find it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FileRecord {
    /// What they are told of it.
    pub(crate) file: SumsFile,
    /// Where its first row begins.
    pub(crate) first: u64,
    /// Where it is cut, where that is by bytes.
    pub(crate) parts: Option<Parts>,
}

/// A block of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FileBlock {
    /// Row of the record with which it begins, from 0.
    pub(crate) first: u64,
    /// Steps that start in it.
    pub(crate) n_step: usize,
    /// Its rows.
    pub(crate) bytes: Bytes,
}

/// The recordings as workers find them; `None` where one has to be read here, or cannot be.
pub(crate) fn files(records: &[InferRecord], cut: Cut) -> Option<Vec<FileRecord>> {
    // Rows that are none of the file's, and blocks that reach over the next one's start.
    if cut.resample || cut.block <= cut.ahead {
        return None;
    }
    records.iter().map(|record| file(record, cut)).collect()
}

fn file(record: &InferRecord, cut: Cut) -> Option<FileRecord> {
    // Which rows are inside a span is known from their times.
    if record.span[0].is_finite() || record.span[1].is_finite() {
        return None;
    }
    let rows = open(record).ok()?;
    let path = std::path::absolute(&record.file).ok()?.to_str()?.to_owned();
    let mut text = File::open(&record.file).ok()?;
    let (length, modified) = stamp(&text)?;
    let (first, n_cell, cells) =
        (after_line_end(&mut text, rows.n_byte())?, rows.n_cell(), rows.cells().to_vec());
    let parts = cut.bytes.map(|bytes| Parts::new(rows.n_byte(), length, bytes));
    Some(FileRecord { file: SumsFile { path, length, modified, n_cell, cells }, first, parts })
}

/// Where the line after the header begins: its reader may stand between the two bytes of a line end.
fn after_line_end(text: &mut File, at: u64) -> Option<u64> {
    text.seek(SeekFrom::Start(at.checked_sub(1)?)).ok()?;
    let mut bytes = Vec::new();
    text.take(2).read_to_end(&mut bytes).ok()?;
    Some(if bytes == *b"\r\n" { at + 1 } else { at })
}

/// The blocks of one file, in the memory of one portion.
pub(crate) struct FileBlocks<R> {
    text: R,
    cut: Cut,
    /// Row and byte up to which lines are counted.
    row: u64,
    byte: u64,
    /// Byte of the first row of the next block.
    start: u64,
    /// Row of the next block.
    first: u64,
    is_over: bool,
}

impl FileBlocks<BufReader<File>> {
    /// The blocks of a recording.
    pub(crate) fn open(record: &FileRecord, cut: Cut) -> std::io::Result<Self> {
        let mut file = File::open(&record.file.path)?;
        file.seek(SeekFrom::Start(record.first))?;
        Ok(Self::new(BufReader::with_capacity(1 << 18, file), record.first, cut))
    }
}

impl<R: BufRead> FileBlocks<R> {
    /// The blocks of a text of rows that begins at a byte of its file.
    pub(crate) fn new(text: R, start: u64, cut: Cut) -> Self {
        Self { text, cut, row: 0, byte: start, start, first: 0, is_over: false }
    }

    /// The next block; `None` at the end of the recording.
    pub(crate) fn next(&mut self) -> std::io::Result<Option<FileBlock>> {
        if self.is_over {
            return Ok(None);
        }
        let (block, first, start) = (self.cut.block as u64, self.first, self.start);
        self.count_to(first + block)?;
        let next = self.byte;
        self.count_to(first + block + 1 + self.cut.ahead as u64)?;
        let n_row = (self.row - first) as usize;
        // As `Blocks::rest`: the last one ends with the last row.
        let n_step = self.cut.block.min(n_row.saturating_sub(1));
        self.is_over = n_step + 1 >= n_row && n_row < self.cut.block + 1 + self.cut.ahead;
        (self.first, self.start) = (first + block, next);
        let bytes = Bytes { start, length: self.byte - start, n_row };
        Ok((n_step > 0).then_some(FileBlock { first, n_step, bytes }))
    }

    /// Goes on to the start of a row, or to the end.
    fn count_to(&mut self, row: u64) -> std::io::Result<()> {
        while self.row < row {
            let held = self.text.fill_buf()?;
            if held.is_empty() {
                // A last line without a line end has been counted below.
                return Ok(());
            }
            let portion = &held[..held.len().min(PORTION)];
            let n = memchr::memchr_iter(b'\n', portion).count() as u64;
            let used = if self.row + n < row {
                self.row += n;
                portion.len()
            } else {
                let last = (row - self.row) as usize - 1;
                self.row = row;
                memchr::memchr_iter(b'\n', portion).nth(last).map_or(portion.len(), |at| at + 1)
            };
            self.byte += used as u64;
            let is_open = portion[used - 1] != b'\n';
            self.text.consume(used);
            if is_open && self.row < row && self.text.fill_buf()?.is_empty() {
                self.row += 1;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use super::*;
    use crate::blocks::Blocks;
    use crate::rows::Rows;

    fn record() -> InferRecord {
        InferRecord {
            name: "path".to_owned(),
            file: "data.csv".into(),
            time: "t".to_owned(),
            columns: vec!["x".to_owned()],
            span: [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    #[test]
    fn the_blocks_of_a_file_are_those_of_its_rows() {
        let record = record();
        for n_row in [2, 3, 9, 10, 11, 12, 13, 14, 19, 20, 21, 22, 23, 24, 31, 2000] {
            for (block, ahead) in [(1, 0), (2, 1), (4, 3), (10, 0), (10, 1), (10, 3), (500, 3)] {
                let cut = Cut { step: 1.0, block, bytes: None, ahead, breaks: false, resample: false };
                let mut text = "t,x\n".to_owned();
                (0..n_row).for_each(|k| writeln!(text, "{k},{}", k * k).unwrap_or_default());
                for text in [text.as_str(), text.trim_end()] {
                    let rows = Rows::new(Path::new("data.csv"), text.as_bytes(), "t", &record.columns)
                        .unwrap_or_else(|error| panic!("{error}"));
                    let mut blocks = Blocks::new((0, &record), rows, cut);
                    let mut of_file = FileBlocks::new(&text.as_bytes()[4..], 4, cut);
                    while let Some(whole) = blocks.next().unwrap_or_else(|error| panic!("{error}")) {
                        let found = of_file.next().ok().flatten();
                        let found = found
                            .unwrap_or_else(|| panic!("a block less of {n_row} rows by {block} + {ahead}"));
                        let place = format!("{n_row} rows by {block} + {ahead}: {found:?}");
                        assert_eq!((found.first, found.n_step), (whole.first, whole.n_step), "{place}");
                        assert_eq!(found.bytes.n_row, whole.times.len(), "{place}");
                        let from = found.bytes.start as usize;
                        let part = &text[from..from + found.bytes.length as usize];
                        let times: Vec<f64> =
                            part.lines().filter_map(|line| line.split(',').next()?.parse().ok()).collect();
                        assert_eq!(times, whole.times, "{place}");
                    }
                    assert_eq!(of_file.next().ok().flatten(), None, "{n_row} rows by {block} + {ahead}");
                }
            }
        }
    }

    #[test]
    fn a_recording_with_a_span_or_without_a_file_is_read_here() {
        let record = InferRecord { file: "no such file".into(), ..record() };
        let cut = Cut { step: 1.0, block: 10, bytes: None, ahead: 3, breaks: false, resample: false };
        assert_eq!(files(std::slice::from_ref(&record), cut), None);
        let dir = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let file = dir.path().join("data.csv");
        std::fs::write(&file, "\u{feff}x,\"t\"\r\n1,0\r\n").unwrap_or_else(|error| panic!("{error}"));
        let record = InferRecord { file, ..record };
        let found = files(std::slice::from_ref(&record), cut).unwrap_or_default();
        assert_eq!((found[0].first, found[0].file.n_cell), (10, 2));
        assert_eq!(found[0].file.cells, [1, 0]);
        for cut in [Cut { resample: true, ..cut }, Cut { block: 3, ..cut }] {
            assert_eq!(files(std::slice::from_ref(&record), cut), None, "{cut:?}");
        }
        assert_eq!(files(&[InferRecord { span: [0.0, f64::INFINITY], ..record }], cut), None);
    }
}
