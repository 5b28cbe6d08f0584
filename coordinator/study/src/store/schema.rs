//! The tables of a run and the statements that fill them.

use rusqlite::{Connection, params};

use super::{AnalysisRow, JobRow, PredictionRow};

/// Version of the tables below; a store of another version is refused.
pub(super) const SCHEMA_VERSION: i64 = 1;

pub(super) const SCHEMA: &str = "
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE events (id INTEGER PRIMARY KEY, at_s REAL NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL);
CREATE TABLE jobs (id INTEGER PRIMARY KEY, pass INTEGER NOT NULL, step INTEGER NOT NULL, record TEXT NOT NULL,
  particle INTEGER NOT NULL, attempts INTEGER NOT NULL, worker TEXT NOT NULL, status TEXT NOT NULL, error TEXT, cost_s REAL,
  answer BLOB);
CREATE TABLE analyses (pass INTEGER NOT NULL, step INTEGER NOT NULL, time REAL NOT NULL, n_used INTEGER NOT NULL,
  nis REAL NOT NULL, log_likelihood REAL NOT NULL, information_lost REAL NOT NULL, PRIMARY KEY (pass, step));
CREATE TABLE estimates (pass INTEGER NOT NULL, step INTEGER NOT NULL, parameter TEXT NOT NULL, estimate REAL NOT NULL,
  lo REAL NOT NULL, hi REAL NOT NULL, mean REAL NOT NULL, sd REAL NOT NULL);
CREATE TABLE innovations (pass INTEGER NOT NULL, step INTEGER NOT NULL, record TEXT NOT NULL, output TEXT NOT NULL,
  time REAL NOT NULL, innovation REAL NOT NULL, sd REAL NOT NULL);
CREATE TABLE predictions (record TEXT NOT NULL, output TEXT NOT NULL, time REAL NOT NULL, observed REAL, predicted REAL NOT NULL,
  use TEXT NOT NULL, noise REAL NOT NULL);
CREATE TABLE snapshot (id INTEGER PRIMARY KEY CHECK (id = 1), head TEXT NOT NULL);
CREATE TABLE snapshot_states (record INTEGER PRIMARY KEY, rows INTEGER NOT NULL, columns INTEGER NOT NULL, body BLOB NOT NULL);
";

pub(super) fn insert_analysis(connection: &Connection, row: &AnalysisRow) -> rusqlite::Result<()> {
    connection
        .prepare_cached("INSERT OR REPLACE INTO analyses (pass, step, time, n_used, nis, log_likelihood, information_lost)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        )?
        .execute(params![
            row.pass,
            row.step,
            row.time,
            row.n_used,
            row.nis,
            row.log_likelihood,
            row.information_lost
        ])?;
    let mut insert =
        connection.prepare_cached("INSERT INTO estimates VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")?;
    for e in &row.estimates {
        insert.execute(params![row.pass, row.step, e.parameter, e.estimate, e.lo, e.hi, e.mean, e.sd])?;
    }
    let mut insert =
        connection.prepare_cached("INSERT INTO innovations VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?;
    for i in &row.innovations {
        insert.execute(params![row.pass, row.step, i.record, i.output, i.time, i.innovation, i.sd])?;
    }
    Ok(())
}

pub(super) fn insert_jobs(connection: &Connection, jobs: &[JobRow]) -> rusqlite::Result<()> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO jobs (pass, step, record, particle, attempts, worker, status, error, cost_s, answer)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
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
            job.cost_s,
            job.answer.map(|answer| answer.bytes())
        ])?;
    }
    Ok(())
}

pub(super) fn insert_predictions(connection: &Connection, rows: &[PredictionRow]) -> rusqlite::Result<()> {
    let mut insert =
        connection.prepare_cached("INSERT INTO predictions VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?;
    for row in rows {
        insert.execute(params![
            row.record,
            row.output,
            row.time,
            row.observed,
            row.predicted,
            row.usage,
            row.noise
        ])?;
    }
    Ok(())
}
