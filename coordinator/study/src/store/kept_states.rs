//! Large states that the last snapshot needs: pieces in the run folder, their names in the database.
//!
//! The order makes a kill at any moment safe: first the pieces stand in the folder, then the row that names them is committed, then the
//! pieces that only the row before it named may go. The states of runs that arrived before their analysis is made are kept in the same
//! order, and go when the analysis is committed that used them. Next file to read: [`super::snapshot`].

use std::collections::HashMap;
use std::time::Instant;

use starlings_fleet::{StateStore, StoredState};

use super::{RunKey, Store, StoreError};

/// The names of the pieces of each particle's state, for states that are too large for a row.
pub(super) const TABLE: &str =
    "CREATE TABLE IF NOT EXISTS snapshot_pieces (record INTEGER NOT NULL, particle INTEGER NOT NULL,
  n_state INTEGER NOT NULL, pieces BLOB NOT NULL, PRIMARY KEY (record, particle)) WITHOUT ROWID";

/// A commit waits until the time since the last one is so many times what writing the pieces takes: a tenth of a run's time at most
/// goes into what a resume needs.
const SPARING: f64 = 9.0;

/// States held for the sake of a resume.
#[derive(Default)]
pub(super) struct KeptStates {
    /// Of the snapshot in the database.
    committed: Vec<StoredState>,
    /// Of the one that the next commit puts there.
    written: Option<Vec<StoredState>>,
    /// What the pieces of the last commit took, in s.
    took_s: f64,
    /// Of runs that arrived and are in no analysis yet.
    arrived: HashMap<RunKey, StoredState>,
    /// Of those that are in the analysis that the next commit makes durable.
    spent: Vec<StoredState>,
    /// When the pieces of runs that arrive may be written again.
    rests_until: Option<Instant>,
}

impl KeptStates {
    /// Notes what the snapshot needs that the next commit puts into the database.
    pub(super) fn wrote(&mut self, states: Vec<StoredState>) {
        self.written = Some(states);
        self.spent();
    }

    /// Whether the pieces of runs that arrive have taken their share of the time.
    pub(super) fn rests(&self) -> bool {
        self.rests_until.is_some_and(|until| Instant::now() < until)
    }

    /// Has the pieces of runs that arrived stand in the folder, and holds them.
    pub(super) fn arrive(
        &mut self,
        states: impl Iterator<Item = (RunKey, StoredState)>,
    ) -> Result<(), StoreError> {
        let started = Instant::now();
        for (key, state) in states {
            state.persist()?;
            self.arrived.insert(key, state);
            self.rests_until = Some(Instant::now() + started.elapsed().mul_f64(SPARING));
        }
        Ok(())
    }

    /// Holds the states of runs that an earlier start was told of.
    pub(super) fn found(&mut self, states: impl Iterator<Item = (RunKey, StoredState)>) {
        self.arrived.extend(states);
    }

    /// The state of a run that arrived.
    pub(super) fn arrived(&self, key: &RunKey) -> Option<StoredState> {
        self.arrived.get(key).cloned()
    }

    /// The runs that arrived are in an analysis, which the next commit makes durable.
    pub(super) fn spent(&mut self) {
        self.spent.extend(self.arrived.drain().map(|(_, state)| state));
    }

    /// Has all pieces that the database names stay in the folder when nobody holds them any more.
    pub(super) fn leave(&mut self) {
        let all = self.committed.iter().chain(self.arrived.values());
        all.chain(&self.spent).for_each(StoredState::leave);
    }

    /// Has the pieces stand in the folder before the commit.
    pub(super) fn before_commit(&mut self) -> Result<(), StoreError> {
        let Some(written) = &self.written else { return Ok(()) };
        let started = Instant::now();
        written.iter().try_for_each(StoredState::persist)?;
        self.took_s = if written.is_empty() { 0.0 } else { started.elapsed().as_secs_f64() };
        Ok(())
    }

    /// Lets go of what the snapshot before needed.
    pub(super) fn after_commit(&mut self) {
        if let Some(written) = self.written.take() {
            self.committed = written;
        }
        self.spent.clear();
    }

    /// How long to hold analyses back, in s.
    pub(super) fn hold_s(&self) -> f64 {
        SPARING * self.took_s
    }
}

/// The states of one record: which, their length, by particle.
type OfRecord = (usize, usize, Vec<StoredState>);

impl Store {
    /// The states that the snapshot names.
    ///
    /// # Errors
    /// When the database refuses, its content is damaged, or a piece is missing.
    pub(super) fn kept_states(&self, kept: &StateStore) -> Result<Vec<OfRecord>, StoreError> {
        let rows: Vec<(usize, usize, usize, Vec<u8>)> = self.rows(
            "SELECT record, particle, n_state, pieces FROM snapshot_pieces ORDER BY record, particle",
            |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)),
        )?;
        let mut found: Vec<OfRecord> = Vec::new();
        for (record, particle, n_state, pieces) in rows {
            let (names, rest) = pieces.as_chunks::<32>();
            if !rest.is_empty() {
                return Err(self.damaged("snapshot", "the names of the pieces of a state"));
            }
            let state = kept.reopen(n_state, names)?;
            match found.last_mut().filter(|(last, ..)| *last == record) {
                Some((_, n, columns)) if *n == n_state && columns.len() == particle => columns.push(state),
                None if particle == 0 => found.push((record, n_state, vec![state])),
                _ => return Err(self.damaged("snapshot", "the states of its particles do not fit together")),
            }
        }
        kept.sweep();
        self.kept.borrow_mut().committed = found.iter().flat_map(|(.., columns)| columns).cloned().collect();
        Ok(found)
    }

    /// Forgets the states: the run is finished.
    ///
    /// # Errors
    /// When the database refuses.
    pub(super) fn forget_states(&self) -> Result<(), StoreError> {
        self.guard(self.connection.execute_batch("DELETE FROM snapshot_pieces; DELETE FROM arrived_states"))?;
        self.commit()?;
        *self.kept.borrow_mut() = KeptStates::default();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::snapshot::{Ensemble, Figures, Matrix, Snapshot};
    use super::super::{AnalysisRow, ArrivedRun, Store};
    use super::*;
    use crate::states::States;
    use crate::states::stored::StoredStates;

    const N: usize = 40_000;

    fn snapshot(states: &StateStore, step: usize) -> Snapshot {
        let column = |k: usize| {
            let values: Vec<f64> = (0..N).map(|i| (i * (k + 1) + step) as f64).collect();
            states.keep(&values).expect("room")
        };
        let figures = Figures { step, ..Figures::default() };
        let (centre, scale) = (Vec::new(), Vec::new());
        let estimate = Ensemble { theta: Matrix::default(), centre, scale, cost: None, narrow: 1.0 }.into();
        let columns = StoredStates::of(N, (0..3).map(column).collect());
        Snapshot { figures, estimate, states: vec![None, Some(States::Stored(columns))] }
    }

    fn row(step: usize) -> AnalysisRow {
        AnalysisRow {
            pass: 1,
            step,
            time: 0.0,
            n_used: 1,
            nis: 1.0,
            log_likelihood: -1.0,
            information_lost: 0.0,
            estimates: Vec::new(),
            innovations: Vec::new(),
            jobs: Vec::new(),
        }
    }

    fn read(path: &std::path::Path) -> (Snapshot, StateStore) {
        let store = Store::open(&path.join("run.db")).expect("it opens");
        let states = StateStore::new(usize::MAX);
        assert!(states.settle(&path.join("states")));
        let snapshot = Snapshot::read(&store, 2, &states).expect("it is whole").expect("there is one");
        (snapshot, states)
    }

    fn second_column(snapshot: &Snapshot) -> Vec<f64> {
        snapshot.states[1].as_ref().expect("a running record").held(1).into_values().expect("it is there")
    }

    #[test]
    fn a_run_killed_at_any_moment_has_the_pieces_of_the_snapshot_in_its_database() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
        let states = StateStore::new(usize::MAX);
        states.settle(&folder.path().join("states"));
        let files = || std::fs::read_dir(folder.path().join("states")).expect("a folder").count();
        for step in 0..4 {
            let now = snapshot(&states, step);
            store.analysis(&row(step), &now).expect("room");
            drop(now);
            if step > 0 {
                // Killed here, a resume goes on from the last commit.
                let (kept, _) = read(folder.path());
                assert_eq!(kept.figures.step, step - 1);
                assert!(
                    second_column(&kept) == (0..N).map(|i| (2 * i + step - 1) as f64).collect::<Vec<_>>()
                );
            }
            store.commit().expect("room");
            assert_eq!(files(), 6, "those of the snapshot before are gone");
        }
        assert_eq!(states.n_pieces(), 6);
        store.forget_states().expect("room");
        assert_eq!((states.n_pieces(), files()), (0, 0));
    }

    #[test]
    fn a_run_that_arrived_with_a_large_state_is_found_again_until_its_analysis_is_stored() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
        let states = StateStore::new(usize::MAX);
        states.settle(&folder.path().join("states"));
        let files = || std::fs::read_dir(folder.path().join("states")).expect("a folder").count();
        let (key, values) = ([7; 32], (0..N).map(|i| i as f64 / 3.0).collect::<Vec<_>>());
        let state = Some(states.keep(&values).expect("room"));
        let run = ArrivedRun { attempts: 1, worker: "w".to_owned(), body: vec![1], state };
        store.keep_arrived(&[(key, run)]).expect("room");
        assert_eq!(files(), 2);
        // Killed here, a resume has it, and leaves it when it ends in order.
        let (again, fresh) =
            (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
        fresh.settle(&folder.path().join("states"));
        again.reopen_arrived(&fresh).expect("it is whole");
        fresh.sweep();
        let found = again.arrived(&key).expect("readable").expect("it is there");
        assert!(found.state.expect("in the folder").values().expect("readable") == values);
        drop(again);
        assert_eq!(files(), 2);
        // With a piece missing it is made again.
        let (third, fresh) =
            (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
        fresh.settle(&tempfile::tempdir().expect("a folder").path().join("states"));
        third.reopen_arrived(&fresh).expect("no error");
        assert_eq!(third.arrived(&key).expect("readable").and_then(|run| run.state), None);
        drop(third);
        store.analysis(&row(0), &snapshot(&states, 0)).expect("room");
        assert_eq!(files(), 2, "the row that names it stands until the commit");
        store.commit().expect("room");
        assert_eq!((files(), states.n_pieces()), (6, 6), "those of the snapshot alone");
        assert_eq!(store.arrived_keys().expect("readable").len(), 0);
        drop(store);
        assert_eq!(files(), 6, "an end in order leaves what a resume needs");
    }

    #[test]
    fn a_piece_that_is_missing_on_resume_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
        let states = StateStore::new(usize::MAX);
        states.settle(&folder.path().join("states"));
        store.analysis(&row(0), &snapshot(&states, 0)).expect("room");
        store.commit().expect("room");
        let file = std::fs::read_dir(folder.path().join("states")).expect("a folder").next();
        let file = file.expect("a piece").expect("readable").path();
        std::fs::remove_file(&file).expect("removed");
        let (again, fresh) =
            (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
        fresh.settle(&folder.path().join("states"));
        let error = Snapshot::read(&again, 2, &fresh).expect_err("a piece is missing").to_string();
        assert!(error.contains(&file.file_name().expect("a name").to_string_lossy().into_owned()), "{error}");
        std::mem::forget(store);
    }
}
