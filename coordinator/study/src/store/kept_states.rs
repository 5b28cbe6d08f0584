//! Large states that the last snapshot needs: pieces in the run folder, their names in the database.
//!
//! The order makes a kill at any moment safe: first the pieces stand in the folder, then the row that names them is committed, then the
//! pieces that only the row before it named may go. The states of runs that arrived before their analysis is made are kept in the same
//! order, and go when the analysis is committed that used them. Next file to read: [`super::snapshot`].

#[cfg(test)]
mod tests;

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
    /// When that was.
    committed_at: Option<Instant>,
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
            self.committed_at = Some(Instant::now());
        }
        self.spent.clear();
    }

    /// Whether a snapshot waits whose pieces would take more than their share of the time.
    pub(super) fn holds_back(&self) -> bool {
        let since = self.committed_at.map(|at| at.elapsed().as_secs_f64());
        self.written.is_some() && since.is_some_and(|since| since < self.hold_s())
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
