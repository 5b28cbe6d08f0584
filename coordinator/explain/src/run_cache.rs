//! The run cache: runs variants of the model on the fleet and remembers the result of every run in the run's database.
//!
//! Every record is run from its start, without an observer, over training and held-out spans alike. Points of different variants
//! go in one batch, so that a screening is one round for the fleet. An explanation that was killed requests the same runs again;
//! those that are in the database are not made a second time. The cache also counts runs against the budget. It returns the
//! predictions of all rows; its callers show a fit the training rows only. Next files to read: [`batches`], then
//! [`crate::fit::model_variant`].

mod batches;
mod foreseen;
mod lru;
mod remembered;
mod tracks;

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use nalgebra::DVector;
use starlings_fleet::{Fleet, FleetEvent};
use starlings_models::Window;
use starlings_study::store::{RunKey, Store, StoreError};
use starlings_study::{Stage, Study};

pub(crate) use self::foreseen::{Course, Foreseen};
use self::lru::LruCache;
use crate::error::ExplainError;
use crate::options::{Context, HOLD};
use crate::rows::Rows;

/// A variant of the model and a parameter vector (transformed units) to run it with.
pub struct Point<'v> {
    /// The variant.
    pub study: &'v Study,
    /// Its parameters, in the order of its [`Study::theta`].
    pub theta: DVector<f64>,
}

/// What a point predicts for every row, or why it could not be run.
pub(crate) type RowPredictions = Result<Arc<Vec<f64>>, String>;

/// Runs points, remembers the runs, and counts them against the budget.
pub struct RunCache<'a> {
    /// The study as it is.
    pub study: &'a Study,
    /// Its measured values.
    pub rows: Rows,
    fleet: &'a mut dyn Fleet,
    store: &'a Store,
    clock: &'a dyn Fn() -> f64,
    earlier_s: f64,
    watch: &'a mut dyn FnMut(&Stage),
    events: Option<&'a Receiver<FleetEvent>>,
    windows: Vec<Arc<Window>>,
    /// Keys of the runs that were requested and counted; their results are in the store.
    counted: HashSet<RunKey>,
    recent: LruCache,
    /// Bytes of one kind of intermediate results that are held at most; what exceeds them is computed again when it is needed.
    hold: usize,
    budget: Option<u64>,
    stage: &'static str,
    /// How much there is still to do.
    pub(crate) foreseen: Foreseen,
    runs: Vec<(&'static str, u64)>,
    workers: BTreeSet<String>,
    n_batch: usize,
    cut_short: bool,
    /// Runs that would have sufficed for what was not done first.
    wanted: Option<u64>,
}

impl<'a> RunCache<'a> {
    /// A run cache for one study.
    pub fn new(
        study: &'a Study,
        fleet: &'a mut dyn Fleet,
        store: &'a Store,
        context: &'a mut Context<'_>,
        budget: Option<u64>,
    ) -> Self {
        let windows = (0..study.records.len()).map(|r| Arc::new(study.whole(r, false))).collect();
        let rows = Rows::new(study);
        let foreseen = Foreseen::new(study, rows.rows.len());
        Self {
            study,
            rows,
            fleet,
            store,
            clock: context.clock,
            earlier_s: context.earlier_s,
            watch: &mut *context.watch,
            events: context.events,
            windows,
            counted: HashSet::new(),
            recent: LruCache::new(HOLD),
            hold: HOLD,
            budget,
            stage: "fit",
            foreseen,
            runs: Vec::new(),
            workers: BTreeSet::new(),
            n_batch: 0,
            cut_short: false,
            wanted: None,
        }
    }

    /// Holds so many bytes of every kind of intermediate results at most. Nothing that is found depends on it.
    pub(crate) fn hold_at_most(&mut self, bytes: usize) {
        (self.hold, self.recent) = (bytes, LruCache::new(bytes));
    }

    /// Whether so many series of all rows may be held.
    pub(crate) fn holds(&self, n_series: usize) -> bool {
        n_series <= self.series_held()
    }

    /// Series of all rows that may be held.
    pub(crate) fn series_held(&self) -> usize {
        self.hold / (8 * self.rows.rows.len()).max(1)
    }

    /// Begins a stage and reports it.
    pub(crate) fn stage(&mut self, name: &'static str, says: &str) {
        self.stage = name;
        self.foreseen.stage(name);
        self.report_stage(says, 0);
    }

    /// Reports the stage, of which so many runs are made next.
    fn report_stage(&mut self, says: &str, next: usize) {
        // Those that are made next are counted already.
        let (runs, workers) = (self.runs().saturating_sub(next as u64), self.fleet.n_workers());
        let work = self.foreseen.work(next);
        (self.watch)(&Stage { name: self.stage, says: says.to_owned(), runs, workers, work });
    }

    /// Runs so far: one particle over one record each.
    pub(crate) fn runs(&self) -> u64 {
        self.runs.iter().map(|(_, n)| n).sum()
    }

    /// Runs by stage.
    pub(crate) fn runs_by_stage(&self) -> Vec<(String, u64)> {
        self.runs.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect()
    }

    /// Counts runs that were made on the fleet without this cache.
    pub(crate) fn count(&mut self, n: u64) {
        self.foreseen.count(n);
        match self.runs.iter_mut().find(|(name, _)| *name == self.stage) {
            Some((_, count)) => *count += n,
            None => self.runs.push((self.stage, n)),
        }
    }

    /// Workers that answered.
    pub(crate) fn n_answered(&self) -> usize {
        self.workers.len()
    }

    /// The fleet, for runs that are not over whole records.
    pub(crate) fn fleet(&mut self) -> &mut dyn Fleet {
        self.fleet
    }

    /// Warnings about workers whose results were not those of others.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(crate) fn told_of_workers(&self) -> Result<Vec<String>, StoreError> {
        self.store.told_of_workers()
    }

    /// The folder of the run.
    pub(crate) fn folder(&self) -> &std::path::Path {
        self.store.folder()
    }

    /// Wall time so far, in s.
    pub(crate) fn elapsed(&self) -> f64 {
        self.earlier_s + (self.clock)()
    }

    /// Whether so many more points keep within the budget.
    pub(crate) fn affords(&self, n_point: usize) -> bool {
        self.affords_runs(self.cost(n_point))
    }

    /// Whether so many more runs keep within the budget.
    pub(crate) fn affords_runs(&self, n: u64) -> bool {
        self.budget.is_none_or(|budget| self.runs() + n <= budget)
    }

    /// Notes that so many points were not run because the budget did not suffice.
    pub(crate) fn lacks(&mut self, n_point: usize) {
        self.wanted = self.wanted.or(Some(self.runs() + self.cost(n_point)));
    }

    /// The budget, and the runs that would have sufficed for what was not done first.
    pub(crate) fn too_small(&self) -> Option<(u64, u64)> {
        self.budget.zip(self.wanted)
    }

    /// Notes that something was not done because the budget did not suffice.
    pub(crate) fn cut_short(&mut self) {
        self.cut_short = true;
    }

    /// Whether something was not done because the budget did not suffice.
    pub(crate) fn was_cut_short(&self) -> bool {
        self.cut_short
    }

    /// The error of a budget that does not suffice for so many more points.
    pub(crate) fn beyond_budget(&self, n_point: usize) -> ExplainError {
        let (budget, needed) = (self.budget.unwrap_or(0), self.cost(n_point));
        ExplainError::Budget { budget, stage: self.stage, needed }
    }

    fn cost(&self, n_point: usize) -> u64 {
        (n_point * self.windows.len()) as u64
    }
}
