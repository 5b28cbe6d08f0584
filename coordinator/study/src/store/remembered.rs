//! Runs of the model that need not be made twice: their answers by a key of everything that went into them.
//!
//! What a key covers and how an answer is written as bytes is decided by the caller. Next file to read: [`crate::store`].

use rusqlite::{OptionalExtension, params};

use super::schema::insert_jobs;
use super::{JobRow, Store, StoreError};

/// BLAKE3 of everything that a run's answer depends on.
pub type RunKey = [u8; 32];

/// Made at opening too: stores of earlier programs of the same version lack it.
pub(super) const TABLE: &str =
    "CREATE TABLE IF NOT EXISTS remembered_runs (key BLOB PRIMARY KEY, body BLOB NOT NULL);";

impl Store {
    /// Keeps the answers of runs and the rows of their jobs in one piece: after a kill either all are there or none. An earlier
    /// answer of the same key is replaced.
    ///
    /// # Errors
    /// When the database refuses; none of them is kept then.
    pub fn remember_runs<'a>(
        &self,
        runs: impl IntoIterator<Item = (&'a RunKey, impl AsRef<[u8]>)>,
        jobs: &[JobRow],
    ) -> Result<(), StoreError> {
        self.commit()?;
        let write = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            let mut insert = transaction
                .prepare_cached("INSERT OR REPLACE INTO remembered_runs (key, body) VALUES (?1, ?2)")?;
            for (key, body) in runs {
                insert.execute(params![key.as_slice(), body.as_ref()])?;
            }
            drop(insert);
            insert_jobs(&transaction, jobs)?;
            transaction.commit()
        };
        self.guard(write())
    }

    /// The answer of an earlier run, if it was kept.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn remembered_run(&self, key: &RunKey) -> Result<Option<Vec<u8>>, StoreError> {
        let mut select =
            self.guard(self.connection.prepare_cached("SELECT body FROM remembered_runs WHERE key = ?1"))?;
        self.guard(select.query_row([key.as_slice()], |row| row.get(0)).optional())
    }

    /// Whether the answer of an earlier run was kept.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn has_remembered_run(&self, key: &RunKey) -> Result<bool, StoreError> {
        let mut select =
            self.guard(self.connection.prepare_cached("SELECT 1 FROM remembered_runs WHERE key = ?1"))?;
        self.guard(select.exists([key.as_slice()]))
    }

    /// Removes all answers, which are no longer needed, and frees their space.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn forget_runs(&self) -> Result<(), StoreError> {
        self.commit()?;
        self.guard(self.connection.execute_batch("DELETE FROM remembered_runs; VACUUM"))
    }

    /// All answers that are kept.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn remembered_runs(&self) -> Result<Vec<(RunKey, Vec<u8>)>, StoreError> {
        self.rows("SELECT key, body FROM remembered_runs", |row| Ok((row.get(0)?, row.get(1)?)))
    }
}
