//! Batches of a run whose store keeps what is known of its runs: those are not made again, and what arrives is kept at once.
//!
//! Next files to read: [`super::journal`] for runs of the analysis that is being made, [`super::timeouts`] for decisions.

use std::ops::ControlFlow;

use starlings_fleet::{Fleet, FleetError, Held, Outcome, SetupId};
use starlings_models::{Failure, Job};
use starlings_proto::JobKeys;

use super::index::AnalysisIndex;
use super::journal::Journal;
use super::timeouts::Timeouts;
use crate::RunError;
use crate::store::{Store, StoreError};

/// What a store keeps of the runs of a fit.
pub(super) struct Kept<'a> {
    timeouts: Timeouts<'a>,
    journal: Journal<'a>,
}

impl<'a> Kept<'a> {
    /// What the store holds.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn read(store: &'a Store) -> Result<Self, StoreError> {
        Ok(Self { timeouts: Timeouts::read(store)?, journal: Journal::read(store)? })
    }

    /// A warning about the timeouts in the store, if there are any.
    pub(super) fn warning(&self) -> Option<String> {
        self.timeouts.warning()
    }

    /// Runs jobs and returns an outcome per job, in their order; those whose outcome is known are not run. `job` gives the same
    /// job whenever it is asked for one.
    ///
    /// # Errors
    /// When the fleet fails as a whole, which names jobs by their places here, or the store.
    pub(super) fn run(
        &mut self,
        fleet: &mut dyn Fleet,
        at: AnalysisIndex,
        n_job: usize,
        job: impl Fn(usize) -> (SetupId, Job<Held>),
    ) -> Result<Vec<Outcome<Held>>, RunError> {
        let mut keys = JobKeys::default();
        let mut known = self.known(&mut keys, at, n_job, &job)?;
        let open: Vec<usize> = (0..n_job).filter(|index| known[*index].is_none()).collect();
        if open.is_empty() {
            return Ok(known.into_iter().flatten().collect());
        }
        let mut refused = None;
        let (journal, lasts) = (&self.journal, at.is_of_fit());
        let mut arrived = |outcomes: Vec<(usize, Outcome<Held>)>| {
            let decided = |outcome: &Outcome<Held>| matches!(outcome.result, Err(Failure::Timeout(_)));
            let outcomes = outcomes.into_iter().filter(|(_, outcome)| lasts || !decided(outcome));
            let named = outcomes.map(|(index, outcome)| {
                let (setup, job) = job(open[index]);
                (setup, job, outcome)
            });
            match journal.keep(&mut keys, named) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    refused = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        let outcomes = fleet.run_telling(open.iter().map(|index| job(*index)).collect(), &mut arrived);
        if let Some(error) = refused {
            return Err(error.into());
        }
        if matches!(outcomes, Err(FleetError::Disagreement { .. })) {
            // Who of them is wrong is not known, nor whose results were kept.
            self.journal.forget()?;
        }
        for (index, outcome) in open.iter().zip(outcomes.map_err(|error| placed(error, &open))?) {
            if let (true, Err(Failure::Timeout(timeout))) = (lasts, &outcome.result) {
                let (setup, job) = job(*index);
                self.timeouts.keep(&mut keys, &setup, &job, timeout)?;
            }
            known[*index] = Some(outcome);
        }
        Ok(known.into_iter().flatten().collect())
    }

    /// The outcomes that are known.
    fn known(
        &mut self,
        keys: &mut JobKeys,
        at: AnalysisIndex,
        n_job: usize,
        job: &impl Fn(usize) -> (SetupId, Job<Held>),
    ) -> Result<Vec<Option<Outcome<Held>>>, StoreError> {
        // The forward run with the estimate decides nothing about a sigma point: it is tried anew.
        let decided = at.is_of_fit() && !self.timeouts.is_empty();
        if !decided && self.journal.is_empty() {
            return Ok(vec![None; n_job]);
        }
        let mut known = Vec::with_capacity(n_job);
        for (setup, job) in (0..n_job).map(job) {
            let timeout = if decided { self.timeouts.known(keys, &setup, &job) } else { None };
            let outcome = match timeout {
                Some(outcome) => Some(outcome),
                None => self.journal.known(keys, &setup, &job)?,
            };
            if let Some(Err(Failure::Timeout(timeout))) = outcome.as_ref().map(|known| &known.result) {
                self.timeouts.keep(keys, &setup, &job, timeout)?;
            }
            known.push(outcome);
        }
        Ok(known)
    }
}

/// An error that names a job by its place among the open ones, with its place among all.
fn placed(error: FleetError, open: &[usize]) -> FleetError {
    match error {
        FleetError::NoAnswer { job, particle, record, reason } => {
            let job = open.get(job).copied().unwrap_or(job);
            FleetError::NoAnswer { job, particle, record, reason }
        }
        other => other,
    }
}
