//! Has the sums of every block made as jobs of the fleet, and merges them in the order of the blocks.
//!
//! Recordings are read while the fleet works; so many blocks are held as a few batches have, whatever the length of a recording. What is
//! merged does not depend on who made which block. Next file to read: `convergence.rs`.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use starlings_estimators::inference::Sums;
use starlings_fleet::{Fleet, Outcome, SetupId};
use starlings_models::Setup;
use starlings_study::infer_choice::InferRecord;
use starlings_sums::{Question, block, sums_of};

use crate::blocks::{Block, Blocks, Cut, open};
use crate::error::InferError;

/// Numbers of one batch at most.
const BATCH_NUMBERS: usize = 1 << 22;
/// Blocks of one batch at most.
const BATCH_BLOCKS: usize = 64;

/// Blocks that are to be summed.
pub(crate) struct Work<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) question: &'a Question,
    pub(crate) records: &'a [InferRecord],
    pub(crate) cut: Cut,
    pub(crate) levels: u32,
}

/// What blocks add up to.
#[derive(Debug, Clone)]
pub(crate) struct Gathered {
    /// Sums by level, the sampling step first.
    pub(crate) levels: Vec<Sums>,
    /// Blocks so far.
    pub(crate) n_block: u64,
    /// Steps of each record so far.
    pub(crate) steps: Vec<u64>,
    /// First and last time of each record so far.
    pub(crate) spans: Vec<[f64; 2]>,
    record: usize,
}

impl Work<'_> {
    /// Has all blocks summed; `told` hears of what there is after every block.
    pub(crate) fn gather(
        &self,
        fleet: &mut dyn Fleet,
        told: &mut dyn FnMut(&Gathered, &dyn Fleet) -> Result<(), InferError>,
    ) -> Result<Gathered, InferError> {
        let id = fleet.install(self.setup)?;
        let mut gathered = self.empty();
        std::thread::scope(|scope| {
            let (sender, batches) = sync_channel(1);
            scope.spawn(move || self.read(&sender));
            self.sum(fleet, id, &batches, &mut gathered, told)
        })?;
        if let Some(k) = gathered.steps.iter().position(|n| *n == 0) {
            let name = &self.records[k].name;
            return Err(InferError::Setting(format!(
                "record `{name}` has no two rows one step apart in its span"
            )));
        }
        Ok(gathered)
    }

    fn empty(&self) -> Gathered {
        let level = |k| Sums::new(&self.question.basis, self.cut.step * f64::from(1_u32 << k));
        Gathered {
            levels: (0..self.levels).map(level).collect(),
            n_block: 0,
            steps: vec![0; self.records.len()],
            spans: vec![[f64::NAN; 2]; self.records.len()],
            record: 0,
        }
    }

    /// Reads all recordings in batches of blocks. A reader whose batches nobody takes ends.
    fn read(&self, sender: &SyncSender<Result<Vec<Block>, InferError>>) {
        let width = 1 + self.question.basis.n_channel();
        let most = (BATCH_NUMBERS / (width * (self.cut.block + 1))).clamp(1, BATCH_BLOCKS);
        let mut batch = Vec::new();
        for (k, record) in self.records.iter().enumerate() {
            let opened = open(record);
            let mut blocks = match opened {
                Ok(rows) => Blocks::new((k, record), rows, self.cut),
                Err(error) => return drop(sender.send(Err(error))),
            };
            loop {
                match blocks.next() {
                    Ok(Some(block)) => batch.push(block),
                    Ok(None) => break,
                    Err(error) => return drop(sender.send(Err(error))),
                }
                if batch.len() >= most && sender.send(Ok(std::mem::take(&mut batch))).is_err() {
                    return;
                }
            }
        }
        let _ = sender.send(Ok(batch));
    }

    fn sum(
        &self,
        fleet: &mut dyn Fleet,
        id: SetupId,
        batches: &Receiver<Result<Vec<Block>, InferError>>,
        gathered: &mut Gathered,
        told: &mut dyn FnMut(&Gathered, &dyn Fleet) -> Result<(), InferError>,
    ) -> Result<(), InferError> {
        for batch in batches {
            let batch = batch?;
            let places: Vec<Place> = batch.iter().map(Place::of).collect();
            let number = |k: usize| gathered.n_block as u32 + k as u32;
            let jobs = batch.into_iter().enumerate();
            let jobs = jobs.map(|(k, b)| block(number(k), b.first, b.n_step, b.times, b.rows)).collect();
            let outcomes = fleet.run(id, jobs)?;
            for (place, outcome) in places.iter().zip(outcomes) {
                self.add(gathered, place, outcome)?;
                told(gathered, &*fleet)?;
            }
        }
        Ok(())
    }

    fn add(&self, gathered: &mut Gathered, place: &Place, outcome: Outcome) -> Result<(), InferError> {
        let name = || self.records[place.record].name.clone();
        let found = outcome.result.map_err(|failure| InferError::Block { record: name(), failure })?;
        let sums = sums_of(self.question, self.cut.step, self.levels, &found.state)?;
        for (whole, sums) in gathered.levels.iter_mut().zip(&sums) {
            if place.record != gathered.record {
                // Nothing of one recording is joined to another.
                *whole = whole.clone().detach();
            }
            whole.merge(sums)?;
        }
        gathered.record = place.record;
        gathered.n_block += 1;
        gathered.steps[place.record] += place.n_step as u64;
        let span = &mut gathered.spans[place.record];
        *span = [if span[0].is_nan() { place.span[0] } else { span[0] }, place.span[1]];
        Ok(())
    }
}

/// Where a block stands.
struct Place {
    record: usize,
    n_step: usize,
    span: [f64; 2],
}

impl Place {
    fn of(block: &Block) -> Self {
        let last = block.times.get(block.n_step).copied().unwrap_or(f64::NAN);
        let first = block.times.first().copied().unwrap_or(f64::NAN);
        Self { record: block.record, n_step: block.n_step, span: [first, last] }
    }
}
