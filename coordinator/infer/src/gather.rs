//! Has the sums of every block made as jobs of the fleet, and merges them in the order of the blocks.
//!
//! Recordings are read while the fleet works; so many blocks are held as a few batches have, whatever the length of a recording. Workers that
//! may read files parse their own blocks ([`Source::Files`]); otherwise rows travel. What is merged does not depend on that, nor on who made
//! which block. Next file to read: `convergence.rs`.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use starlings_estimators::inference::{InferenceError, Pairs, Sums};
use starlings_fleet::{Fleet, Outcome, SetupId};
use starlings_models::{Job, Setup};
use starlings_study::infer_choice::InferRecord;
use starlings_sums::{BlockAnswer, Fault, Part, Question, answer_of, block, file_block, file_part};

use crate::blocks::{Block, Blocks, Cut, open};
use crate::constancy::Stretches;
use crate::error::InferError;
use crate::file_blocks::{FileBlock, FileBlocks, FileRecord};

/// Numbers of one batch at most.
const BATCH_NUMBERS: usize = 1 << 22;
/// Blocks of the first batch; each later one has twice as many, so that workers begin at once and seldom wait for one another.
const FIRST_BLOCKS: usize = 4;
/// Blocks of one batch at most, where rows travel and where places in a file do. Those of a batch wait for one another.
const BATCH_BLOCKS: usize = 64;
const BATCH_PLACES: usize = 256;

/// Blocks that are to be summed.
pub(crate) struct Work<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) question: &'a Question,
    pub(crate) records: &'a [InferRecord],
    pub(crate) cut: Cut,
    pub(crate) levels: u32,
}

/// Who reads the recordings.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    /// This process: rows travel.
    Rows,
    /// The workers, every block for itself.
    Files(&'a [FileRecord]),
}

/// What blocks add up to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gathered {
    /// Sums by level, the sampling step first.
    pub(crate) levels: Vec<Sums>,
    /// Blocks so far.
    pub(crate) n_block: u64,
    /// Steps of each record so far.
    pub(crate) steps: Vec<u64>,
    /// First and last time of each record so far.
    pub(crate) spans: Vec<[f64; 2]>,
    /// The sampling step's sums once more, by stretches.
    pub(crate) stretches: Stretches,
    /// A sample of its steps.
    pub(crate) pairs: Pairs,
    record: usize,
}

/// Hears of what there is after every block, and before a batch of the number of its blocks.
type Told<'a> = dyn FnMut(&Gathered, Option<usize>, &dyn Fleet) + 'a;

impl Work<'_> {
    /// Has all blocks summed. `None` where a file has something else than plain rows, one step apart: then its rows are read here, which
    /// tells what it is, or goes on behind a gap.
    pub(crate) fn gather(
        &self,
        source: Source<'_>,
        fleet: &mut dyn Fleet,
        told: &mut Told<'_>,
    ) -> Result<Option<Gathered>, InferError> {
        let id = match source {
            Source::Rows => fleet.install(self.setup)?,
            Source::Files(files) => fleet.install(&self.with_files(files))?,
        };
        let mut gathered = self.empty();
        let is_whole = std::thread::scope(|scope| {
            let (sender, batches) = sync_channel(1);
            scope.spawn(move || match source {
                Source::Rows => self.read(&sender),
                Source::Files(files) => self.find(files, &sender),
            });
            self.sum(fleet, id, &batches, &mut gathered, told)
        });
        match (is_whole, source) {
            (Ok(()), _) => {}
            (Err(InferError::Unread | InferError::Row { .. }), Source::Files(_)) => return Ok(None),
            (Err(InferError::Row { record, error }), Source::Rows) => {
                return Err(self.told_at(record, &error));
            }
            (Err(error), _) => return Err(error),
        }
        if let Some(k) = gathered.steps.iter().position(|n| *n == 0) {
            if let Source::Files(_) = source {
                return Ok(None);
            }
            let name = &self.records[k].name;
            return Err(InferError::Setting(format!(
                "record `{name}` has no two rows one step apart in its span"
            )));
        }
        Ok(Some(gathered))
    }

    /// The setup of workers that read files.
    fn with_files(&self, files: &[FileRecord]) -> Setup {
        let mut setup = self.setup.clone();
        if let Some(sums) = &mut setup.sums {
            sums.files = files.iter().map(|record| record.file.clone()).collect();
        }
        setup
    }

    fn empty(&self) -> Gathered {
        let level = |k| Sums::new(&self.question.basis, self.cut.step * f64::from(1_u32 << k));
        Gathered {
            levels: (0..self.levels).map(level).collect(),
            n_block: 0,
            steps: vec![0; self.records.len()],
            spans: vec![[f64::NAN; 2]; self.records.len()],
            stretches: Stretches::default(),
            pairs: Pairs::new(self.question.basis.n_channel()),
            record: 0,
        }
    }

    /// Reads all recordings in batches of blocks. A reader whose batches nobody takes ends.
    fn read(&self, sender: &SyncSender<Result<Vec<Job>, InferError>>) {
        let width = 1 + self.question.basis.n_channel();
        let most = (BATCH_NUMBERS / (width * (self.cut.block + 1))).clamp(1, BATCH_BLOCKS);
        let mut batch = Vec::new();
        let mut wanted = FIRST_BLOCKS.min(most);
        for (k, record) in self.records.iter().enumerate() {
            let opened = open(record);
            let mut blocks = match opened {
                Ok(rows) => Blocks::new((k, record), rows, self.cut),
                Err(error) => return drop(sender.send(Err(error))),
            };
            loop {
                match blocks.next() {
                    Ok(Some(Block { record, first, n_step, times, rows })) => {
                        batch.push(block(record as u32, first, n_step, times, rows));
                    }
                    Ok(None) => break,
                    Err(error) => return drop(sender.send(Err(error))),
                }
                if batch.len() >= wanted {
                    wanted = (2 * wanted).min(most);
                    if sender.send(Ok(std::mem::take(&mut batch))).is_err() {
                        return;
                    }
                }
            }
        }
        let _ = sender.send(Ok(batch));
    }

    /// Finds the blocks of all files, in batches.
    fn find(&self, files: &[FileRecord], sender: &SyncSender<Result<Vec<Job>, InferError>>) {
        let mut batch = Vec::new();
        let mut wanted = FIRST_BLOCKS;
        for (k, record) in files.iter().enumerate() {
            if let Some(parts) = record.parts {
                for part in 0..parts.n {
                    let [from, to] = parts.range(part, record.file.length);
                    batch.push(file_part(k as u32, Part { from, to, ahead: self.cut.ahead }));
                    if batch.len() >= BATCH_PLACES && sender.send(Ok(std::mem::take(&mut batch))).is_err() {
                        return;
                    }
                }
                continue;
            }
            let Ok(mut blocks) = FileBlocks::open(record, self.cut) else {
                return drop(sender.send(Err(InferError::Unread)));
            };
            loop {
                match blocks.next() {
                    Ok(Some(FileBlock { first, n_step, bytes })) => {
                        batch.push(file_block(k as u32, first, n_step, bytes));
                    }
                    Ok(None) => break,
                    Err(_) => return drop(sender.send(Err(InferError::Unread))),
                }
                if batch.len() >= wanted {
                    wanted = (2 * wanted).min(BATCH_PLACES);
                    if sender.send(Ok(std::mem::take(&mut batch))).is_err() {
                        return;
                    }
                }
            }
        }
        let _ = sender.send(Ok(batch));
    }

    fn sum(
        &self,
        fleet: &mut dyn Fleet,
        id: SetupId,
        batches: &Receiver<Result<Vec<Job>, InferError>>,
        gathered: &mut Gathered,
        told: &mut Told<'_>,
    ) -> Result<(), InferError> {
        for batch in batches {
            let mut jobs = batch?;
            let records: Vec<usize> = jobs.iter().map(|job| job.record as usize).collect();
            for (k, job) in jobs.iter_mut().enumerate() {
                job.particle = gathered.n_block as u32 + k as u32;
            }
            told(gathered, Some(jobs.len()), &*fleet);
            let outcomes = fleet.run(id, jobs)?;
            for (record, outcome) in records.into_iter().zip(outcomes) {
                self.add(gathered, record, outcome)?;
                told(gathered, None, &*fleet);
            }
        }
        Ok(())
    }

    fn add(&self, gathered: &mut Gathered, record: usize, outcome: Outcome) -> Result<(), InferError> {
        let name = || self.records[record].name.clone();
        let found = outcome.result.map_err(|failure| InferError::Block { record: name(), failure })?;
        let answer = answer_of(self.question, self.cut.step, self.levels, &found.state)?;
        let BlockAnswer { levels, span, pairs } = answer.map_err(|fault| match fault {
            Fault::Unread => InferError::Unread,
            Fault::Row(error) => InferError::Row { record, error },
        })?;
        for (whole, sums) in gathered.levels.iter_mut().zip(&levels) {
            if record != gathered.record {
                // Nothing of one recording is joined to another.
                *whole = whole.clone().detach();
            }
            whole.merge(sums)?;
        }
        if let Some(sums) = levels.first().filter(|sums| sums.n_step() > 0) {
            gathered.stretches.add(sums, record, span[0])?;
        }
        gathered.pairs.merge(&pairs)?;
        gathered.record = record;
        gathered.n_block += 1;
        gathered.steps[record] += levels.first().map_or(0, Sums::n_step);
        let whole = &mut gathered.spans[record];
        *whole = [if whole[0].is_nan() { span[0] } else { whole[0] }, span[1]];
        Ok(())
    }

    /// A fault of a row with its file and line, for which the recording is read once more up to there.
    fn told_at(&self, record: usize, error: &InferenceError) -> InferError {
        let (row, help) = match error {
            InferenceError::NonFinite { row, .. } => {
                (*row, "leave out the function, or record where it has a value and a slope")
            }
            InferenceError::NonUniform { row, .. } => {
                (*row, "an inference needs equal steps: `resample = STEP` in [infer] interpolates to them")
            }
            InferenceError::NotIncreasing { row, .. } => (*row, "keep one row per time, in their order"),
            InferenceError::TimeJump { row, .. } => (
                *row,
                "use gaps = \"break\" in [infer] to go on behind it without a step across; `resample = STEP` is for rows at unequal times",
            ),
            _ => return error.clone().into(),
        };
        let record = &self.records[record];
        let line = || {
            let mut values = vec![0.0; record.columns.len()];
            let mut rows = self.cut.feed(open(record).ok()?, values.len());
            (0..row).try_for_each(|_| rows.next(&mut values).ok()?.map(drop))?;
            rows.next(&mut values).ok()?.map(|row| row.line)
        };
        let message = match error {
            InferenceError::NonFinite { what, value, .. } => {
                format!("{what} is {value} in the step that begins in this row")
            }
            other => other.to_string(),
        };
        InferError::Recording { file: record.file.clone(), line: line(), message, help: help.to_owned() }
    }
}

#[cfg(test)]
mod tests;
