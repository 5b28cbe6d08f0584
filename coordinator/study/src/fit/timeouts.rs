//! Timeouts of a run, as decisions: kept in the store at once, and repeated without a run by a resume.
//!
//! A limit of wall time depends on the machine, so the same run may be in time once and late another time. A timeout, once
//! stored, is not decided anew. Nothing else is kept here: a prediction is the same whenever it is made. Next file to read:
//! [`super::runner`].

use std::collections::HashMap;

use starlings_fleet::{Held, Outcome, SetupId};
use starlings_models::{Job, Timeout};
use starlings_proto::JobKeys;

use crate::run_key;
use crate::store::{RunKey, Store, StoreError};

/// Timeouts by the keys of their runs.
pub(super) struct Timeouts<'a> {
    store: &'a Store,
    known: HashMap<RunKey, Timeout>,
    /// Digest of the programs that make the runs now: timeouts of other programs do not count.
    programs: [u8; 32],
}

impl<'a> Timeouts<'a> {
    /// Those that the store holds.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn read(store: &'a Store) -> Result<Self, StoreError> {
        let known =
            store.remembered_runs()?.into_iter().filter_map(|(key, body)| Some((key, decode(&body)?)));
        Ok(Self { store, known: known.collect(), programs: store.program()?.digest() })
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The warning about them for a reader of the result.
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
    pub(super) fn known(
        &self,
        keys: &mut JobKeys,
        setup: &SetupId,
        job: &Job<Held>,
    ) -> Option<Outcome<Held>> {
        let timeout = self.known.get(&run_key::observed(&self.programs, keys, setup, job))?;
        Some(Outcome { result: Err(timeout.clone().into()), attempts: 0, worker: String::new() })
    }

    /// Keeps the timeout of a job.
    ///
    /// # Errors
    /// When the store refuses.
    pub(super) fn keep(
        &mut self,
        keys: &mut JobKeys,
        setup: &SetupId,
        job: &Job<Held>,
        timeout: &Timeout,
    ) -> Result<(), StoreError> {
        let key = run_key::observed(&self.programs, keys, setup, job);
        self.store.remember_runs([(&key, encode(timeout).as_slice())], &[])?;
        self.known.insert(key, timeout.clone());
        Ok(())
    }
}

/// Separates the keys of timeouts from those of the answers of an explanation.
const MARK: u8 = 2;

fn encode(timeout: &Timeout) -> Vec<u8> {
    [&[MARK], timeout.limit.to_le_bytes().as_slice(), timeout.says.as_bytes()].concat()
}

fn decode(body: &[u8]) -> Option<Timeout> {
    let rest = body.strip_prefix(&[MARK])?;
    let (limit, says) = rest.split_first_chunk::<8>()?;
    Some(Timeout { limit: f64::from_le_bytes(*limit), says: String::from_utf8_lossy(says).into_owned() })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use starlings_models::Window;

    use super::*;

    #[test]
    fn another_program_decides_anew_whether_a_run_is_in_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::create(&folder.path().join("run.db"), &[("program", r#"{"build": "one"}"#)]);
        let store = store.expect("a store");
        let window =
            Window { start: 0.0, times: vec![1.0], observed: vec![2.0], inputs: Vec::new(), since: vec![] };
        let job = Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![3.0], state: None };
        let setup = [7; 32];
        let late = Timeout { limit: 5.0, says: "it did not answer within 5 s".to_owned() };
        let mut keys = JobKeys::default();
        let mut timeouts = Timeouts::read(&store).expect("none");
        timeouts.keep(&mut keys, &setup, &job, &late).expect("room");
        let same = Timeouts::read(&store).expect("one");
        assert!(same.known(&mut keys, &setup, &job).is_some());
        store.set_meta("program", r#"{"build": "another"}"#).expect("room");
        let other = Timeouts::read(&store).expect("one");
        assert!(other.known(&mut keys, &setup, &job).is_none());
        assert!(!other.is_empty(), "it is told all the same: earlier analyses may rest on it");
    }
}
