//! Runs of the analysis that is being made, as they arrive: what a resume need not run again.
//!
//! They are removed in the same transaction as the analysis that used them. What a key covers and how a run is written as bytes is
//! decided by the caller. Next file to read: [`super::remembered`], for runs that are kept for longer.

use rusqlite::{Connection, OptionalExtension, params};
use starlings_fleet::{StateStore, StoredState};

use super::{RunKey, Store, StoreError};

/// Made at opening too: stores of earlier programs of the same version lack it.
pub(super) const TABLE: &str = "CREATE TABLE IF NOT EXISTS arrived_runs (key BLOB PRIMARY KEY, attempts INTEGER NOT NULL, \
                                worker TEXT NOT NULL, body BLOB NOT NULL);
                                CREATE TABLE IF NOT EXISTS arrived_states (key BLOB PRIMARY KEY, n_state INTEGER NOT NULL, \
                                pieces BLOB NOT NULL);";

/// A run that has arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrivedRun {
    /// How often it was started.
    pub attempts: u32,
    /// The worker that answered last.
    pub worker: String,
    /// How it ended.
    pub body: Vec<u8>,
    /// The large state that the body names, where it names one.
    pub state: Option<StoredState>,
}

impl Store {
    /// Keeps runs that arrived, and makes everything written before durable. The pieces of their states stand in the folder before
    /// the rows that name them. While those that came before have taken more than their share of the time, runs with large states
    /// are left out, and all of them while the states of a snapshot have.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn keep_arrived(&self, runs: &[(RunKey, ArrivedRun)]) -> Result<(), StoreError> {
        if self.kept.borrow().holds_back() {
            return Ok(());
        }
        self.commit()?;
        let rests = self.kept.borrow().rests();
        let runs = runs.iter().filter(|(_, run)| !rests || run.state.is_none()).collect::<Vec<_>>();
        if runs.is_empty() {
            return Ok(());
        }
        let stated = runs.iter().filter_map(|(key, run)| Some((*key, run.state.clone()?)));
        self.kept.borrow_mut().arrive(stated)?;
        let write = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            let mut insert =
                transaction.prepare_cached("INSERT OR REPLACE INTO arrived_runs VALUES (?1, ?2, ?3, ?4)")?;
            let sql = "INSERT OR REPLACE INTO arrived_states VALUES (?1, ?2, ?3)";
            let mut insert_state = transaction.prepare_cached(sql)?;
            for (key, run) in runs {
                insert.execute(params![key.as_slice(), run.attempts, run.worker, run.body])?;
                if let Some(state) = &run.state {
                    let pieces = state.pieces().as_flattened();
                    insert_state.execute(params![key.as_slice(), state.n_state(), pieces])?;
                }
            }
            drop((insert, insert_state));
            transaction.commit()
        };
        self.guard(write())?;
        self.holds_arrived.set(true);
        Ok(())
    }

    /// The keys of the runs that arrived and are in no analysis yet.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn arrived_keys(&self) -> Result<Vec<RunKey>, StoreError> {
        self.rows("SELECT key FROM arrived_runs", |row| row.get(0))
    }

    /// A run that arrived.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn arrived(&self, key: &RunKey) -> Result<Option<ArrivedRun>, StoreError> {
        let sql = "SELECT attempts, worker, body FROM arrived_runs WHERE key = ?1";
        let mut select = self.guard(self.connection.prepare_cached(sql))?;
        let run = select.query_row([key.as_slice()], |row| {
            let state = self.kept.borrow().arrived(key);
            Ok(ArrivedRun { attempts: row.get(0)?, worker: row.get(1)?, body: row.get(2)?, state })
        });
        self.guard(run.optional())
    }

    /// Finds the states of runs that arrived before in the folder; before [`StateStore::sweep`], which removes what is not held.
    /// A run whose state is not whole there is made again.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn reopen_arrived(&self, states: &StateStore) -> Result<(), StoreError> {
        let rows: Vec<(RunKey, usize, Vec<u8>)> = self
            .rows("SELECT key, n_state, pieces FROM arrived_states", |row| {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?))
            })?;
        let whole = rows.into_iter().filter_map(|(key, n_state, pieces)| {
            Some((key, states.reopen(n_state, pieces.as_chunks::<32>().0).ok()?))
        });
        self.kept.borrow_mut().found(whole);
        Ok(())
    }

    /// Removes the runs that arrived, once what was made of them is stored; part of whatever transaction is open.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn forget_arrived(&self) -> Result<(), StoreError> {
        self.guard(forget(&self.connection, self.holds_arrived.get()))?;
        self.holds_arrived.set(false);
        self.kept.borrow_mut().spent();
        Ok(())
    }
}

/// Removes them where there are any.
pub(super) fn forget(connection: &Connection, any: bool) -> rusqlite::Result<()> {
    if any {
        connection.prepare_cached("DELETE FROM arrived_runs")?.execute([])?;
        connection.prepare_cached("DELETE FROM arrived_states")?.execute([])?;
    }
    Ok(())
}

/// Whether there are any.
pub(super) fn any(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("SELECT EXISTS (SELECT 1 FROM arrived_runs)", [], |row| row.get(0))
}
