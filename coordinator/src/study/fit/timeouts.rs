//! Timeouts of a run, as decisions: kept in the store at once, and repeated without a run by a resume.
//!
//! A limit of wall time depends on the machine, so the same run may be in time once and late another time. What was decided once
//! stays decided. Nothing else is kept here: a prediction is the same whenever it is made. Next file to read: [`super::flight`].

use std::collections::HashMap;

use starlings_models::{Job, Timeout};

use crate::fleet::{Outcome, SetupId};
use crate::study::run_key;
use crate::study::store::{RunKey, Store, StoreError};

/// Timeouts by the keys of their runs.
pub(super) struct Timeouts<'a> {
    store: &'a Store,
    known: HashMap<RunKey, Timeout>,
}

impl<'a> Timeouts<'a> {
    /// Those that the store holds.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn read(store: &'a Store) -> Result<Self, StoreError> {
        let known =
            store.remembered_runs()?.into_iter().filter_map(|(key, body)| Some((key, decode(&body)?)));
        Ok(Self { store, known: known.collect() })
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// What a reader of the result must know of them.
    pub(super) fn warning(&self) -> Option<String> {
        let n = self.known.len();
        let limit = self.known.values().map(|timeout| timeout.limit).next()?;
        let (runs, were) = if n == 1 { ("1 run", "was") } else { (&*format!("{n} runs"), "were") };
        Some(format!(
            "{runs} of the fit {were} given up after {limit} s (`timeout`), which a faster or quieter machine may have finished: \
             this result need not be the same elsewhere; a longer `timeout` decides nothing by the time."
        ))
    }

    /// The timeout of a job as its outcome, if it was decided before.
    pub(super) fn known(&self, setup: &SetupId, job: &Job) -> Option<Outcome> {
        let timeout = self.known.get(&run_key::observed(setup, job))?;
        Some(Outcome { result: Err(timeout.clone().into()), attempts: 0, worker: String::new() })
    }

    /// Keeps the timeout of a job.
    ///
    /// # Errors
    /// When the store refuses.
    pub(super) fn keep(&mut self, setup: &SetupId, job: &Job, timeout: &Timeout) -> Result<(), StoreError> {
        let key = run_key::observed(setup, job);
        self.store.remember_runs([(&key, encode(timeout).as_slice())], &[])?;
        self.known.insert(key, timeout.clone());
        Ok(())
    }
}

/// What tells a timeout from the answers of an explanation.
const MARK: u8 = 2;

fn encode(timeout: &Timeout) -> Vec<u8> {
    [&[MARK], timeout.limit.to_le_bytes().as_slice(), timeout.says.as_bytes()].concat()
}

fn decode(body: &[u8]) -> Option<Timeout> {
    let rest = body.strip_prefix(&[MARK])?;
    let (limit, says) = rest.split_first_chunk::<8>()?;
    Some(Timeout { limit: f64::from_le_bytes(*limit), says: String::from_utf8_lossy(says).into_owned() })
}
