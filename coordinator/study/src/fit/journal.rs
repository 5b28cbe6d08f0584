//! The runs of a fit that are done while their batch still goes on, kept in the store so that a resume does not repeat them.
//!
//! A batch that is over within [`starlings_fleet::TELL_EVERY`] is never written: making it again costs less than that. Timeouts are
//! decisions that outlive their analysis and are kept by [`super::timeouts`]. A large state is kept by its name, with its pieces in the
//! run folder. Next file to read: [`super::runner`].

use std::collections::HashSet;

use starlings_fleet::{Held, Outcome, SetupId, StoredState};
use starlings_models::{Failure, Job, ParticleError, Prediction};
use starlings_proto::convert::ended;
use starlings_proto::{JobKeys, State};

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
        job: &Job<Held>,
    ) -> Result<Option<Outcome<Held>>, StoreError> {
        let key = run_key::observed(&self.programs, keys, setup, job);
        if !self.known.remove(&key) {
            return Ok(None);
        }
        let Some(ArrivedRun { attempts, worker, body, state }) = self.store.arrived(&key)? else {
            return Ok(None);
        };
        let (result, _) = ended::decode(&body).map_err(|error| self.store.damaged("run", error))?;
        let held = |ended| match ended {
            State::Values(values) => Ok(Held::Values(values)),
            State::Named(id) => state.filter(|state| state.id() == id).map(Held::Stored).ok_or(()),
        };
        let result = match result.map(|prediction| prediction.try_map(held)) {
            Ok(Ok(prediction)) => Ok(prediction),
            // Its state is gone: it is made again.
            Ok(Err(())) => return Ok(None),
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
        arrived: impl IntoIterator<Item = (SetupId, Job<Held>, Outcome<Held>)>,
    ) -> Result<(), StoreError> {
        let row = |(setup, job, outcome): (SetupId, Job<Held>, Outcome<Held>)| {
            let Outcome { result, attempts, worker } = outcome;
            let mut state = None;
            let result =
                result.map(|prediction| travelling(prediction, &mut state)).map_err(
                    |failure| match failure {
                        Failure::Model(failed) => ParticleError::Model(failed),
                        Failure::Timeout(late) => ParticleError::Timeout(late),
                    },
                );
            let cost = result.as_ref().map_or(0.0, |prediction| prediction.cost);
            let key = run_key::observed(&self.programs, keys, &setup, &job);
            (key, ArrivedRun { attempts, worker, body: ended::encode(&result, cost), state })
        };
        self.store.keep_arrived(&arrived.into_iter().map(row).collect::<Vec<_>>())
    }

    /// Forgets what arrived, also of earlier starts, at once.
    ///
    /// # Errors
    /// When the store refuses.
    pub(super) fn forget(&self) -> Result<(), StoreError> {
        self.store.forget_arrived()?;
        self.store.commit()
    }
}

/// A prediction as its bytes are kept, and the state that they name.
fn travelling(prediction: Prediction<Held>, stored: &mut Option<StoredState>) -> Prediction<State> {
    let Prediction { outputs, state, cost } = prediction;
    let state = match state {
        Held::Values(values) => State::Values(values),
        Held::Stored(state) => State::Named(stored.insert(state).id()),
    };
    Prediction { outputs, state, cost }
}
