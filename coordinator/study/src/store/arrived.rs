//! Runs of the analysis that is being made, as they arrive: what a resume need not run again.
//!
//! They are removed in the same transaction as the analysis that used them. What a key covers and how a run is written as bytes is
//! decided by the caller. Next file to read: [`super::remembered`], for runs that are kept for longer.

use rusqlite::{Connection, OptionalExtension, params};

use super::{RunKey, Store, StoreError};

/// Made at opening too: stores of earlier programs of the same version lack it.
pub(super) const TABLE: &str = "CREATE TABLE IF NOT EXISTS arrived_runs (key BLOB PRIMARY KEY, attempts INTEGER NOT NULL, \
                                worker TEXT NOT NULL, body BLOB NOT NULL);";

/// A run that has arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrivedRun {
    /// How often it was started.
    pub attempts: u32,
    /// The worker that answered last.
    pub worker: String,
    /// How it ended.
    pub body: Vec<u8>,
}

impl Store {
    /// Keeps runs that arrived, all or none, and makes everything written before durable.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn keep_arrived(&self, runs: &[(RunKey, ArrivedRun)]) -> Result<(), StoreError> {
        self.commit()?;
        if runs.is_empty() {
            return Ok(());
        }
        let write = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            let mut insert =
                transaction.prepare_cached("INSERT OR REPLACE INTO arrived_runs VALUES (?1, ?2, ?3, ?4)")?;
            for (key, run) in runs {
                insert.execute(params![key.as_slice(), run.attempts, run.worker, run.body])?;
            }
            drop(insert);
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
            Ok(ArrivedRun { attempts: row.get(0)?, worker: row.get(1)?, body: row.get(2)? })
        });
        self.guard(run.optional())
    }

    /// Removes the runs that arrived, once what was made of them is stored; part of whatever transaction is open.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn forget_arrived(&self) -> Result<(), StoreError> {
        self.guard(forget(&self.connection, self.holds_arrived.get()))?;
        self.holds_arrived.set(false);
        Ok(())
    }
}

/// Removes them where there are any.
pub(super) fn forget(connection: &Connection, any: bool) -> rusqlite::Result<()> {
    if any {
        connection.prepare_cached("DELETE FROM arrived_runs")?.execute([])?;
    }
    Ok(())
}

/// Whether there are any.
pub(super) fn any(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("SELECT EXISTS (SELECT 1 FROM arrived_runs)", [], |row| row.get(0))
}
