//! The runs of a fit that are done while their batch still goes on, kept in the store so that a resume does not repeat them.
//!
//! A batch that is over within [`starlings_fleet::TELL_EVERY`] is never written: making it again costs less than that. Timeouts are
//! decisions that outlive their analysis and are kept by [`super::timeouts`]. Next file to read: [`super::runner`].

use std::collections::HashSet;

use starlings_fleet::{Outcome, SetupId};
use starlings_models::{Failure, Job, ParticleError};
use starlings_proto::JobKeys;
use starlings_proto::convert::ended;

use crate::run_key;
use crate::store::{ArrivedRun, RunKey, Store, StoreError};

/// Runs by the keys of their jobs.
pub(super) struct Journal<'a> {
    store: &'a Store,
    /// Those of an earlier start of this program.
    known: HashSet<RunKey>,
    /// Digest of the programs that make the runs now: runs of other programs do not count.
    programs: [u8; 32],
}

impl<'a> Journal<'a> {
    /// The one that the store holds.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn read(store: &'a Store) -> Result<Self, StoreError> {
        let known = store.arrived_keys()?.into_iter().collect();
        Ok(Self { store, known, programs: store.program()?.digest() })
    }

    /// Whether no run of an earlier start is left in it.
    pub(super) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The outcome of a job, if it arrived before; every run is asked for once.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn known(
        &mut self,
        keys: &mut JobKeys,
        setup: &SetupId,
        job: &Job,
    ) -> Result<Option<Outcome>, StoreError> {
        let key = run_key::observed(&self.programs, keys, setup, job);
        if !self.known.remove(&key) {
            return Ok(None);
        }
        let Some(ArrivedRun { attempts, worker, body }) = self.store.arrived(&key)? else { return Ok(None) };
        let (result, _) = ended::decode(&body).map_err(|error| self.store.damaged("run", error))?;
        let result = match result {
            Ok(prediction) => Ok(prediction),
            Err(ParticleError::Model(failed)) => Err(Failure::Model(failed)),
            Err(ParticleError::Timeout(late)) => Err(Failure::Timeout(late)),
            Err(other) => return Err(self.store.damaged("run", other)),
        };
        Ok(Some(Outcome { result, attempts, worker }))
    }

    /// Keeps outcomes that arrived, with their jobs; what the store held back is durable then too.
    ///
    /// # Errors
    /// When the store refuses.
    pub(super) fn keep(
        &self,
        keys: &mut JobKeys,
        arrived: impl IntoIterator<Item = (SetupId, Job, Outcome)>,
    ) -> Result<(), StoreError> {
        let row = |(setup, job, outcome): (SetupId, Job, Outcome)| {
            let Outcome { result, attempts, worker } = outcome;
            let result = result.map_err(|failure| match failure {
                Failure::Model(failed) => ParticleError::Model(failed),
                Failure::Timeout(late) => ParticleError::Timeout(late),
            });
            let cost = result.as_ref().map_or(0.0, |prediction| prediction.cost);
            let key = run_key::observed(&self.programs, keys, &setup, &job);
            (key, ArrivedRun { attempts, worker, body: ended::encode(&result, cost) })
        };
        self.store.keep_arrived(&arrived.into_iter().map(row).collect::<Vec<_>>())
    }
}
