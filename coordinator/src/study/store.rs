//! The run's one file: a SQLite database with one row per event, job and analysis.
//!
//! Whatever is shown later — summary, report, export, resume — is read from here and from nowhere else. Each analysis and
//! the snapshot that a resumed run starts from are written in one transaction, so a run killed at any instant continues
//! from its last whole analysis. Nothing here computes. Next file to read: [`crate::study::store::snapshot`].

pub mod folder;
pub mod snapshot;

use std::path::{Path, PathBuf};

use nalgebra::DMatrix;
use rusqlite::{Connection, OptionalExtension, Row, params};

use crate::study::store::snapshot::Snapshot;

/// Version of the tables below; a store of another version is refused.
const SCHEMA_VERSION: i64 = 1;

const SCHEMA: &str = "
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE events (id INTEGER PRIMARY KEY, at_s REAL NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL);
CREATE TABLE jobs (id INTEGER PRIMARY KEY, pass INTEGER NOT NULL, step INTEGER NOT NULL, record TEXT NOT NULL,
  particle INTEGER NOT NULL, attempts INTEGER NOT NULL, worker TEXT NOT NULL, status TEXT NOT NULL, error TEXT, cost_s REAL);
CREATE TABLE analyses (pass INTEGER NOT NULL, step INTEGER NOT NULL, time REAL NOT NULL, n_used INTEGER NOT NULL,
  nis REAL NOT NULL, log_likelihood REAL NOT NULL, information_lost REAL NOT NULL, transform BLOB, PRIMARY KEY (pass, step));
CREATE TABLE estimates (pass INTEGER NOT NULL, step INTEGER NOT NULL, parameter TEXT NOT NULL, estimate REAL NOT NULL,
  lo REAL NOT NULL, hi REAL NOT NULL, mean REAL NOT NULL, sd REAL NOT NULL, PRIMARY KEY (pass, step, parameter));
CREATE TABLE innovations (pass INTEGER NOT NULL, step INTEGER NOT NULL, record TEXT NOT NULL, output TEXT NOT NULL,
  time REAL NOT NULL, innovation REAL NOT NULL, sd REAL NOT NULL);
CREATE TABLE predictions (record TEXT NOT NULL, output TEXT NOT NULL, time REAL NOT NULL, observed REAL, predicted REAL NOT NULL,
  use TEXT NOT NULL, noise REAL NOT NULL);
CREATE TABLE snapshot (id INTEGER PRIMARY KEY CHECK (id = 1), head TEXT NOT NULL);
CREATE TABLE snapshot_states (record INTEGER PRIMARY KEY, rows INTEGER NOT NULL, columns INTEGER NOT NULL, body BLOB NOT NULL);
";

/// Why the store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused; the text names the file and the remedy.
    #[error("cannot write to {path}: {source}{}", remedy(source))]
    Database {
        /// The database file.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// The folder or its database is missing or of another version.
    #[error("{0}")]
    Unusable(String),
    /// A stored value cannot be read back.
    #[error("{path} holds a damaged {what}: {reason}")]
    Damaged {
        /// The database file.
        path: PathBuf,
        /// Which value.
        what: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

fn remedy(source: &rusqlite::Error) -> &'static str {
    match source.sqlite_error_code() {
        Some(rusqlite::ErrorCode::DiskFull) => {
            "; the disk is full: free some space and continue with --resume, every finished analysis is kept"
        }
        Some(rusqlite::ErrorCode::DatabaseBusy | rusqlite::ErrorCode::DatabaseLocked) => {
            "; another process is using this run folder"
        }
        Some(rusqlite::ErrorCode::ReadOnly | rusqlite::ErrorCode::CannotOpen) => {
            "; check that the folder exists and may be written"
        }
        _ => "",
    }
}

/// One row of the table `jobs`.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRow {
    /// Pass, from 1; 0 for the final forward run.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub step: usize,
    /// Record name.
    pub record: String,
    /// Sigma point.
    pub particle: u32,
    /// How often it was tried.
    pub attempts: u32,
    /// The worker that answered last.
    pub worker: String,
    /// The failure, or `None` when it succeeded.
    pub error: Option<String>,
    /// Wall time of the run in s.
    pub cost_s: f64,
}

/// One parameter's estimate after one analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimateRow {
    /// Name in the estimated vector.
    pub parameter: String,
    /// Median, physical units.
    pub estimate: f64,
    /// Lower end of the 95 % interval.
    pub lo: f64,
    /// Upper end of the 95 % interval.
    pub hi: f64,
    /// Mean in transformed units.
    pub mean: f64,
    /// Standard deviation in transformed units.
    pub sd: f64,
}

/// One innovation: observed minus predicted before the analysis that used it.
#[derive(Clone, Debug, PartialEq)]
pub struct InnovationRow {
    /// Record name.
    pub record: String,
    /// Output name.
    pub output: String,
    /// Time in the study's unit.
    pub time: f64,
    /// Observed minus predicted.
    pub innovation: f64,
    /// Its standard deviation as the filter expected it.
    pub sd: f64,
}

/// Everything one analysis leaves behind.
#[derive(Clone, Debug)]
pub struct AnalysisRow {
    /// Pass, from 1.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub step: usize,
    /// Largest time of the step's windows since their records' starts.
    pub time: f64,
    /// Observations used.
    pub n_used: usize,
    /// Normalised innovation squared, summed over the observations.
    pub nis: f64,
    /// Innovation log-likelihood.
    pub log_likelihood: f64,
    /// Share of the spread lost to pulled or dropped sigma points.
    pub information_lost: f64,
    /// The r × r transform; `None` for the batch estimator.
    pub transform: Option<DMatrix<f64>>,
    /// One row per estimated parameter.
    pub estimates: Vec<EstimateRow>,
    /// One row per used observation.
    pub innovations: Vec<InnovationRow>,
    /// One row per run.
    pub jobs: Vec<JobRow>,
}

/// One observation time of the final forward run.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionRow {
    /// Record name.
    pub record: String,
    /// Output name.
    pub output: String,
    /// Time in the study's unit.
    pub time: f64,
    /// Observed value, if there is one.
    pub observed: Option<f64>,
    /// Value predicted by a free run with the estimate.
    pub predicted: f64,
    /// `train`, `held-out` or `held-out-channel`.
    pub usage: String,
    /// Standard deviation of the channel's noise.
    pub noise: f64,
}

/// An open run database.
pub struct Store {
    path: PathBuf,
    connection: Connection,
}

impl Store {
    /// Makes the database of a new run.
    ///
    /// # Errors
    /// When the file exists or cannot be written.
    pub fn create(path: &Path) -> Result<Self, StoreError> {
        if path.exists() {
            return Err(StoreError::Unusable(format!("{} already holds a run", path.display())));
        }
        let store = Self::connect(path, rusqlite::OpenFlags::default())?;
        store.guard(store.connection.execute_batch(SCHEMA))?;
        store.guard(store.connection.pragma_update(None, "user_version", SCHEMA_VERSION))?;
        Ok(store)
    }

    /// Opens the database of an existing run.
    ///
    /// # Errors
    /// When there is none or it was written by another version.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        if !path.is_file() {
            return Err(StoreError::Unusable(format!(
                "no run in {}: expected the file {}",
                folder_of(path),
                path.display()
            )));
        }
        let store = Self::connect(path, rusqlite::OpenFlags::SQLITE_OPEN_READ_WRITE)?;
        let version: i64 =
            store.guard(store.connection.pragma_query_value(None, "user_version", |row| row.get(0)))?;
        if version != SCHEMA_VERSION {
            return Err(StoreError::Unusable(format!(
                "{} has store version {version}, this program reads version {SCHEMA_VERSION}",
                path.display()
            )));
        }
        Ok(store)
    }

    fn connect(path: &Path, flags: rusqlite::OpenFlags) -> Result<Self, StoreError> {
        let connection = Connection::open_with_flags(path, flags)
            .map_err(|source| StoreError::Database { path: path.to_owned(), source })?;
        let store = Self { path: path.to_owned(), connection };
        // WAL with NORMAL keeps every committed transaction through a killed process at the price of one write each.
        store.guard(store.connection.pragma_update(None, "journal_mode", "WAL"))?;
        store.guard(store.connection.pragma_update(None, "synchronous", "NORMAL"))?;
        Ok(store)
    }

    pub(super) fn guard<T>(&self, result: rusqlite::Result<T>) -> Result<T, StoreError> {
        result.map_err(|source| StoreError::Database { path: self.path.clone(), source })
    }

    pub(super) fn connection(&self) -> &Connection {
        &self.connection
    }

    pub(crate) fn damaged(&self, what: &'static str, reason: impl ToString) -> StoreError {
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

    /// Writes one analysis and the snapshot after it, in one transaction.
    ///
    /// # Errors
    /// When the database refuses; nothing of the analysis is then kept.
    pub fn analysis(&mut self, row: &AnalysisRow, snapshot: &Snapshot) -> Result<(), StoreError> {
        let path = self.path.clone();
        let write = |connection: &mut Connection| -> rusqlite::Result<()> {
            let transaction = connection.transaction()?;
            insert_analysis(&transaction, row)?;
            insert_jobs(&transaction, &row.jobs)?;
            snapshot.write(&transaction)?;
            transaction.commit()
        };
        write(&mut self.connection).map_err(|source| StoreError::Database { path, source })
    }

    /// Writes the final forward run, replacing an earlier one.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn predictions(&mut self, rows: &[PredictionRow], jobs: &[JobRow]) -> Result<(), StoreError> {
        let path = self.path.clone();
        let write = |connection: &mut Connection| -> rusqlite::Result<()> {
            let transaction = connection.transaction()?;
            transaction.execute("DELETE FROM predictions", [])?;
            transaction.execute("DELETE FROM jobs WHERE pass = 0", [])?;
            for row in rows {
                transaction
                    .prepare_cached("INSERT INTO predictions VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?
                    .execute(params![
                        row.record,
                        row.output,
                        row.time,
                        row.observed,
                        row.predicted,
                        row.usage,
                        row.noise
                    ])?;
            }
            insert_jobs(&transaction, jobs)?;
            transaction.commit()
        };
        write(&mut self.connection).map_err(|source| StoreError::Database { path, source })
    }

    /// Time of the last event, in s of the run's wall time; zero for a new run.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn last_event_s(&self) -> Result<f64, StoreError> {
        self.guard(
            self.connection().query_row("SELECT coalesce(max(at_s), 0.0) FROM events", [], |row| row.get(0)),
        )
    }

    /// All rows of a query, each mapped by `map`.
    pub(crate) fn rows<T>(
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

fn insert_analysis(connection: &Connection, row: &AnalysisRow) -> rusqlite::Result<()> {
    connection
        .prepare_cached("INSERT OR REPLACE INTO analyses VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")?
        .execute(params![
            row.pass,
            row.step,
            row.time,
            row.n_used,
            row.nis,
            row.log_likelihood,
            row.information_lost,
            row.transform.as_ref().map(|t| crate::study::store::snapshot::to_bytes(t.as_slice()))
        ])?;
    for e in &row.estimates {
        connection
            .prepare_cached("INSERT OR REPLACE INTO estimates VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")?
            .execute(params![row.pass, row.step, e.parameter, e.estimate, e.lo, e.hi, e.mean, e.sd])?;
    }
    for i in &row.innovations {
        connection
            .prepare_cached("INSERT INTO innovations VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?
            .execute(params![row.pass, row.step, i.record, i.output, i.time, i.innovation, i.sd])?;
    }
    Ok(())
}

fn insert_jobs(connection: &Connection, jobs: &[JobRow]) -> rusqlite::Result<()> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO jobs (pass, step, record, particle, attempts, worker, status, error, cost_s)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
    )?;
    for job in jobs {
        let status = if job.error.is_none() { "done" } else { "failed" };
        insert.execute(params![
            job.pass,
            job.step,
            job.record,
            job.particle,
            job.attempts,
            job.worker,
            status,
            job.error,
            job.cost_s
        ])?;
    }
    Ok(())
}

/// The named columns of a table as text, in the order of writing; numbers keep every digit, NULL is empty.
///
/// # Errors
/// When the database refuses.
pub fn table(store: &Store, name: &str, columns: &str) -> Result<Vec<Vec<String>>, StoreError> {
    use rusqlite::types::ValueRef;
    let n = columns.split(", ").count();
    store.rows(&format!("SELECT {columns} FROM {name} ORDER BY rowid"), |row| {
        (0..n)
            .map(|i| {
                Ok(match row.get_ref(i)? {
                    ValueRef::Null => String::new(),
                    ValueRef::Integer(v) => v.to_string(),
                    ValueRef::Real(v) => format!("{v:?}"),
                    ValueRef::Text(v) => String::from_utf8_lossy(v).into_owned(),
                    ValueRef::Blob(v) => format!("{} bytes", v.len()),
                })
            })
            .collect()
    })
}
