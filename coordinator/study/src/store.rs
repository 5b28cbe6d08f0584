//! The run's one file: a SQLite database with one row per event, job and analysis.
//!
//! Whatever is shown later — summary, report, export, resume — is read from here and from nowhere else. Each analysis is
//! written in one piece with the snapshot that a resumed run starts from, and a few quick ones are committed together, so a run
//! killed at any instant continues from a whole analysis a moment before (`commit`). Nothing here computes. Next file to read:
//! [`crate::store::snapshot`].

mod answer;
mod arrived;
mod call;
mod changes;
mod commit;
mod elapsed;
mod error;
pub mod folder;
mod folder_error;
mod identity;
mod info;
mod inputs;
pub(super) mod json;
mod kept_states;
mod lock;
mod make;
mod meaning;
mod program;
mod purpose;
mod remembered;
mod resume;
mod rows;
mod schema;
pub mod snapshot;
mod table;
#[cfg(test)]
mod tests;
mod told;

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};

use rusqlite::{Connection, OptionalExtension, Row, params};

use kept_states::KeptStates;
use schema::{SCHEMA_VERSION, insert_analysis, insert_jobs, insert_predictions};
use snapshot::{Estimate, Snapshot};

pub use answer::Answer;
pub use arrived::ArrivedRun;
pub use error::StoreError;
pub(crate) use inputs::{Inputs, KeptRun};
pub use program::Program;
pub use purpose::{EXPLANATION, Purpose};
pub use remembered::RunKey;
pub use rows::{AnalysisRow, EstimateRow, InnovationRow, JobRow, PredictionRow};
pub use table::table;

/// An open run database.
pub struct Store {
    path: PathBuf,
    connection: Connection,
    /// Time of the last commit, in s of the run's wall time.
    committed_s: Cell<f64>,
    /// Whether there are runs of an analysis that is not made yet.
    holds_arrived: Cell<bool>,
    /// Bytes of inputs that the rows since the last ones allow.
    inputs_allowed: Cell<usize>,
    /// Large states of the last snapshots.
    kept: RefCell<KeptStates>,
}

/// Why a database is not that of a run of this program.
fn foreign(path: &Path, version: i64, n_table: i64) -> String {
    let path = path.display();
    match (version, n_table) {
        (0, 0) => {
            format!(
                "{path} holds nothing: the program was ended while it was made; remove the file and start again"
            )
        }
        (0, _) => format!("{path} is a database of another program: give the folder of a run"),
        _ => format!(
            "{path} has store version {version}, this program reads version {SCHEMA_VERSION}: read it with the program that wrote it, or \
             make the run again"
        ),
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // A destructor returns no error; what was committed before is kept.
        let _ = self.commit();
        // What it names stands in the folder for a resume.
        self.kept.get_mut().leave();
    }
}

impl Store {
    /// Opens the database of an existing run to continue it.
    ///
    /// # Errors
    /// When there is none or it was written by another version.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let store = Self::existing(path, rusqlite::OpenFlags::SQLITE_OPEN_READ_WRITE)?;
        store.keep_a_log()?;
        store.guard(store.connection.execute_batch(remembered::TABLE))?;
        store.guard(store.connection.execute_batch(arrived::TABLE))?;
        store.holds_arrived.set(store.guard(arrived::any(&store.connection))?);
        store.guard(store.connection.execute_batch(kept_states::TABLE))?;
        store.guard(store.connection.execute_batch(inputs::TABLE))?;
        store.add_answers()?;
        Ok(store)
    }

    /// Opens the database of an existing run to read it; the folder may be read-only.
    ///
    /// # Errors
    /// When there is none or it was written by another version.
    pub(crate) fn open_to_read(path: &Path) -> Result<Self, StoreError> {
        Self::existing(path, rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY)
    }

    fn existing(path: &Path, flags: rusqlite::OpenFlags) -> Result<Self, StoreError> {
        if !path.is_file() {
            return Err(StoreError::Unusable(format!(
                "no run in {}: expected the file {}",
                folder_of(path),
                path.display()
            )));
        }
        let store = Self::connect(path, flags)?;
        let version: i64 =
            store.guard(store.connection.pragma_query_value(None, "user_version", |row| row.get(0)))?;
        if version != SCHEMA_VERSION {
            let n_table = "SELECT count(*) FROM sqlite_master";
            let n_table: i64 = store.guard(store.connection.query_row(n_table, [], |row| row.get(0)))?;
            return Err(StoreError::Unusable(foreign(path, version, n_table)));
        }
        Ok(store)
    }

    fn connect(path: &Path, flags: rusqlite::OpenFlags) -> Result<Self, StoreError> {
        let connection = Connection::open_with_flags(path, flags)
            .map_err(|source| StoreError::Database { path: path.to_owned(), source })?;
        Ok(Self {
            path: path.to_owned(),
            connection,
            committed_s: Cell::new(f64::NEG_INFINITY),
            holds_arrived: Cell::new(false),
            inputs_allowed: Cell::new(0),
            kept: RefCell::default(),
        })
    }

    /// WAL with NORMAL keeps every committed transaction through a killed process at the price of one write each.
    fn keep_a_log(&self) -> Result<(), StoreError> {
        self.guard(self.connection.pragma_update(None, "journal_mode", "WAL"))?;
        self.guard(self.connection.pragma_update(None, "synchronous", "NORMAL"))?;
        // KiB of pages in memory: rows are written once and hardly read again.
        self.guard(self.connection.pragma_update(None, "cache_size", -1024))
    }

    /// Folds the log into the one file, so that a finished run can be read from a read-only folder.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn close_log(&self) -> Result<(), StoreError> {
        self.commit()?;
        self.guard(self.connection.pragma_update(None, "journal_mode", "DELETE"))
    }

    /// The folder that the database stands in.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    pub(super) fn guard<T>(&self, result: rusqlite::Result<T>) -> Result<T, StoreError> {
        result.map_err(|source| StoreError::Database { path: self.path.clone(), source })
    }

    pub(super) fn connection(&self) -> &Connection {
        &self.connection
    }

    /// The error that something it holds cannot be read: which, and why.
    pub fn damaged(&self, what: &'static str, reason: impl std::fmt::Display) -> StoreError {
        StoreError::Damaged { path: self.path.clone(), what, reason: reason.to_string() }
    }

    /// Sets a named value of the run.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn set_meta(&self, key: &str, value: &str) -> Result<(), StoreError> {
        self.guard(
            self.connection.execute("INSERT OR REPLACE INTO meta (key, value) VALUES (?1, ?2)", [key, value]),
        )?;
        Ok(())
    }

    /// A named value of the run.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn meta(&self, key: &str) -> Result<Option<String>, StoreError> {
        self.guard(
            self.connection
                .query_row("SELECT value FROM meta WHERE key = ?1", [key], |row| row.get(0))
                .optional(),
        )
    }

    /// Appends an event.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn event(&self, at_s: f64, kind: &str, text: &str) -> Result<(), StoreError> {
        let mut insert = self.guard(
            self.connection.prepare_cached("INSERT INTO events (at_s, kind, text) VALUES (?1, ?2, ?3)"),
        )?;
        self.guard(insert.execute(params![at_s, kind, text]))?;
        Ok(())
    }

    /// Writes one analysis and the snapshot after it, in one piece; [`Store::commit`] or the end of the store makes it durable.
    ///
    /// # Errors
    /// When the database refuses; nothing of the analysis is then kept, and those before are committed.
    pub fn analysis<E: Clone + Into<Estimate>>(
        &self,
        row: &AnalysisRow,
        snapshot: &Snapshot<E>,
    ) -> Result<(), StoreError> {
        let connection = &self.connection;
        let insert = || -> rusqlite::Result<()> {
            insert_analysis(connection, row)?;
            insert_jobs(connection, &row.jobs)?;
            snapshot.write(connection)?;
            arrived::forget(connection, self.holds_arrived.get())?;
            connection.execute_batch("RELEASE analysis")
        };
        let write = || -> rusqlite::Result<()> {
            if connection.is_autocommit() {
                connection.execute_batch("BEGIN IMMEDIATE")?;
            }
            connection.execute_batch("SAVEPOINT analysis")?;
            insert().inspect_err(|_| {
                // The failure before is returned; a full disk may have ended the transaction already.
                let _ = connection.execute_batch("ROLLBACK TO analysis; RELEASE analysis");
            })
        };
        let written = write();
        if written.is_err() {
            // The first failure is returned.
            let _ = self.commit();
        } else {
            self.holds_arrived.set(false);
            self.allow_inputs(row);
            self.kept.borrow_mut().wrote(snapshot.stored());
        }
        self.guard(written)
    }

    /// Writes the final forward run, replacing an earlier one.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn predictions(&self, rows: &[PredictionRow], jobs: &[JobRow]) -> Result<(), StoreError> {
        self.commit()?;
        let write = || -> rusqlite::Result<()> {
            let transaction = self.connection.unchecked_transaction()?;
            transaction.execute("DELETE FROM predictions", [])?;
            transaction.execute("DELETE FROM jobs WHERE pass = 0", [])?;
            insert_predictions(&transaction, rows)?;
            insert_jobs(&transaction, jobs)?;
            transaction.commit()
        };
        self.guard(write())
    }

    /// All rows of a query, each mapped by `map`. The tables are those of `schema.rs`.
    ///
    /// # Errors
    /// When the database refuses, or a row cannot be mapped.
    pub fn rows<T>(
        &self,
        sql: &str,
        map: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, StoreError> {
        let mut statement = self.guard(self.connection().prepare(sql))?;
        let rows = self.guard(statement.query_map([], map))?;
        self.guard(rows.collect())
    }
}

fn folder_of(path: &Path) -> String {
    path.parent().map(|p| p.display().to_string()).unwrap_or_default()
}
