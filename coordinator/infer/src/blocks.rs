//! Cuts a recording into blocks of steps, in the memory of one block.
//!
//! A block's last row is the next one's first. Where a row is missing, repeated or out of step the recording is refused with its line,
//! or a new piece begins where the study allows that. Next file to read: `gather.rs`.

use std::fs::File;
use std::io::{BufReader, Read};

use starlings_estimators::inference::STEP_TOLERANCE;
use starlings_study::infer_choice::InferRecord;

use crate::error::InferError;
use crate::even_step::{even_step, uneven};
use crate::parts::Parts;
use crate::resampled::Feed;
use crate::rows::{Row, Rows};

/// Rows that the sampling step is taken from.
const FIRST: usize = 1000;

/// Steps of a recording that follow one another.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    /// Index of the record.
    pub(crate) record: usize,
    /// Row of the record with which it begins, from 0.
    pub(crate) first: u64,
    /// Steps that start in it.
    pub(crate) n_step: usize,
    /// Times of its rows, some of which lie after its last step.
    pub(crate) times: Vec<f64>,
    /// Values row after row.
    pub(crate) rows: Vec<f64>,
}

/// How recordings are cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    /// Sampling step.
    pub(crate) step: f64,
    /// Steps of a block, about, where it is cut by bytes.
    pub(crate) block: usize,
    /// Bytes of a block, where it is not cut by steps.
    pub(crate) bytes: Option<u64>,
    /// Rows beyond its last step.
    pub(crate) ahead: usize,
    /// Whether a new piece begins where rows are missing.
    pub(crate) breaks: bool,
    /// Whether rows are interpolated to equal steps.
    pub(crate) resample: bool,
}

impl Cut {
    /// The rows of a recording as they are cut, of so many values.
    pub(crate) fn feed<R: Read>(&self, rows: Rows<R>, width: usize) -> Feed<R> {
        Feed::new(rows, self.resample.then_some(self.step), width)
    }
}

/// What the start of a recording says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// Time of the first row of the file.
    pub(crate) first: f64,
    /// Sampling step.
    pub(crate) step: f64,
    /// Number of rows, guessed from the length of the file.
    pub(crate) n_row: f64,
    /// Bytes of a row.
    pub(crate) per_row: f64,
}

/// Opens a recording.
pub(crate) fn open(record: &InferRecord) -> Result<Rows<BufReader<File>>, InferError> {
    let file = File::open(&record.file).map_err(|error| InferError::Recording {
        file: record.file.clone(),
        line: None,
        message: format!("the recording of `{}` cannot be read: {error}", record.name),
        help: "paths are relative to the study file".to_owned(),
    })?;
    Rows::new(&record.file, BufReader::with_capacity(1 << 18, file), &record.time, &record.columns)
}

/// The sampling step of a recording, from its first rows.
pub(crate) fn start(record: &InferRecord) -> Result<Start, InferError> {
    let mut rows = open(record)?;
    let before = rows.n_byte();
    let mut values = vec![0.0; record.columns.len()];
    let mut times = Vec::new();
    let mut n_read = 0_u64;
    let mut first = f64::NAN;
    while times.len() < FIRST {
        let Some(Row { time, .. }) = rows.next(&mut values)? else { break };
        if n_read == 0 {
            first = time;
        }
        n_read += 1;
        if time >= record.span[0] && time <= record.span[1] {
            times.push(time);
        }
    }
    let Some(step) = even_step(&times) else {
        let (message, help) = match times.as_slice() {
            [before, time, ..] => {
                let of = format!("no time of record `{}` is later than the one before", record.name);
                (format!("{of}: {time} follows {before}"), "sort the rows by time, one per time")
            }
            few => (
                format!("record `{}` has too few rows in its span: {}", record.name, few.len()),
                "an inference needs many rows",
            ),
        };
        return Err(rows.fault(None, message, help));
    };
    let per_row = (rows.n_byte() - before) as f64 / n_read as f64;
    let per_row = per_row.max(1.0);
    Ok(Start { first, step, n_row: length(record) as f64 / per_row, per_row })
}

/// Bytes of a recording's file.
pub(crate) fn length(record: &InferRecord) -> u64 {
    std::fs::metadata(&record.file).map_or(0, |file| file.len())
}

/// The blocks of one recording.
pub(crate) struct Blocks<'a, R> {
    record: (usize, &'a InferRecord),
    rows: Feed<R>,
    cut: Cut,
    /// Number of the next row.
    row: u64,
    first: u64,
    times: Vec<f64>,
    values: Vec<f64>,
    /// Where the file is cut, once its first row was read; and the part of every row that is held.
    parts: Option<Parts>,
    of_part: Vec<u64>,
    next: Vec<f64>,
    /// A row that begins a new piece, and its part.
    held: Option<(f64, u64)>,
    is_over: bool,
}

impl<'a, R: Read> Blocks<'a, R> {
    pub(crate) fn new(record: (usize, &'a InferRecord), rows: Rows<R>, cut: Cut) -> Self {
        let next = vec![0.0; record.1.columns.len()];
        Self {
            record,
            rows: cut.feed(rows, record.1.columns.len()),
            cut,
            row: 0,
            first: 0,
            times: Vec::new(),
            values: Vec::new(),
            parts: None,
            of_part: Vec::new(),
            next,
            held: None,
            is_over: false,
        }
    }

    /// The next block; `None` at the end of the recording.
    pub(crate) fn next(&mut self) -> Result<Option<Block>, InferError> {
        loop {
            if self.times.len() <= 1
                && let Some((time, part)) = self.held.take()
            {
                self.begin(time, part);
            }
            while !self.is_whole() && !self.is_over && self.held.is_none() {
                self.read()?;
            }
            if self.is_whole() {
                return Ok(Some(self.full()));
            }
            if self.times.len() > 1 {
                let rest = self.rest();
                return Ok(Some(rest));
            }
            if self.is_over && self.held.is_none() {
                return Ok(None);
            }
        }
    }

    /// Steps of the block that is next; `None` while none of the rows that are held is behind it.
    fn n_step(&self) -> Option<usize> {
        let Some(part) = self.of_part.first().filter(|_| self.cut.bytes.is_some()) else {
            return self.cut.bytes.is_none().then_some(self.cut.block);
        };
        let n = self.of_part.partition_point(|of| of == part);
        (n < self.of_part.len()).then_some(n)
    }

    /// Whether all rows of the next block are held.
    fn is_whole(&self) -> bool {
        self.n_step().is_some_and(|n| self.times.len() > n + self.cut.ahead)
    }

    /// A new piece begins with the row that was read last.
    fn begin(&mut self, time: f64, part: u64) {
        self.times.clear();
        self.values.clear();
        self.of_part.clear();
        self.first = self.row - 1;
        self.hold(time, part);
    }

    fn hold(&mut self, time: f64, part: u64) {
        self.times.push(time);
        self.values.extend_from_slice(&self.next);
        self.of_part.push(part);
    }

    fn read(&mut self) -> Result<(), InferError> {
        let [from, to] = self.record.1.span;
        let Some(Row { line, time, byte }) = self.rows.next(&mut self.next)? else {
            self.is_over = true;
            return Ok(());
        };
        self.row += 1;
        if let (None, Some(bytes)) = (self.parts, self.cut.bytes) {
            self.parts = Some(Parts::new(byte, length(self.record.1), bytes));
        }
        let part = self.parts.map_or(0, |parts| parts.of(byte));
        if time < from || time > to {
            return Ok(());
        }
        let Some(&before) = self.times.last() else {
            self.begin(time, part);
            return Ok(());
        };
        let (step, got) = (self.cut.step, time - before);
        if (got - step).abs() <= STEP_TOLERANCE * step {
            self.hold(time, part);
            return Ok(());
        }
        if got > 1.5 * step && self.cut.breaks {
            self.held = Some((time, part));
            return Ok(());
        }
        Err(self.uneven(line, before, time))
    }

    /// The first of the next rows whose time is not later than that of the row before it, with both times and its line.
    fn back(&mut self, mut before: f64) -> Option<(u64, f64, f64)> {
        for _ in 0..FIRST {
            let Row { line, time, .. } = self.rows.next(&mut self.next).ok()??;
            if time <= before {
                return Some((line, before, time));
            }
            before = time;
        }
        None
    }

    fn uneven(&mut self, line: u64, before: f64, time: f64) -> InferError {
        let step = self.cut.step;
        if time - before > 1.5 * step
            && let Some((line, later, earlier)) = self.back(time)
        {
            let message =
                format!("time goes back from {later} to {earlier}: rows are not in the order of their times");
            return self.rows.fault(Some(line), message, "sort the rows by time, one per time");
        }
        let (message, help) = uneven(step, before, time);
        self.rows.fault(Some(line), message, help)
    }

    /// A whole block, whose last row is kept for the next.
    fn full(&mut self) -> Block {
        let (n, width) = (self.n_step().unwrap_or(self.cut.block), self.next.len());
        let block = Block {
            record: self.record.0,
            first: self.first,
            n_step: n,
            times: self.times.clone(),
            rows: self.values.clone(),
        };
        self.times.drain(..n);
        self.values.drain(..n * width);
        self.of_part.drain(..n);
        self.first += n as u64;
        block
    }

    /// What is left of a piece.
    fn rest(&mut self) -> Block {
        let n_step = (self.times.len() - 1).min(self.n_step().unwrap_or(usize::MAX));
        if n_step + 1 < self.times.len() {
            return Block { n_step, ..self.full() };
        }
        self.of_part.clear();
        let (times, rows) = (std::mem::take(&mut self.times), std::mem::take(&mut self.values));
        Block { record: self.record.0, first: self.first, n_step, times, rows }
    }
}
