//! What runs of a fit were given, at some of its analyses: parameters and states of the particles, bit by bit.
//!
//! Those of the first analysis of a pass are always kept, the others as often as makes the store a thirty-second larger at most; between
//! two of them the particles follow by making the analyses again. States that stand outside the database are kept for a resume alone.
//! Next file to read: [`crate::replay`].

use nalgebra::DMatrix;
use rusqlite::params;
use starlings_proto::convert::floats;

use super::answer::Answer;
use super::{AnalysisRow, Store, StoreError};
use crate::states::States;
use crate::store::snapshot::{Ensemble, Snapshot};

/// Made at opening too: stores of earlier programs of the same version lack it. Passes count from 1.
pub(super) const TABLE: &str = "CREATE TABLE IF NOT EXISTS inputs (pass INTEGER NOT NULL, step INTEGER NOT NULL, part TEXT NOT NULL,
  rows INTEGER NOT NULL, columns INTEGER NOT NULL, body BLOB NOT NULL, PRIMARY KEY (pass, step, part)) WITHOUT ROWID";

/// The rest of the store is so many times what is kept of inputs between the starts of passes.
const SHARE: usize = 32;

/// What a row of the store takes, about, in bytes.
const ROW: usize = 55;

/// Transformed parameters, p × r.
const THETA: &str = "theta";
/// Mean and standard deviations of the prior that a pass started from: two columns, with its first analysis.
const START: &str = "start";
/// Before the number of a record: states of the particles at the start of its window, n × r.
const STATE: &str = "state ";

/// What the particles of an analysis were given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Inputs {
    /// Pass, from 1.
    pub(crate) pass: usize,
    /// Analysis within the pass, from 0.
    pub(crate) step: usize,
    /// Transformed parameters, p × r.
    pub(crate) theta: DMatrix<f64>,
    /// Mean and standard deviations of the prior that the pass started from; `None` for a batch fit.
    pub(crate) start: Option<DMatrix<f64>>,
    /// States by record; `None` where the window is the first one of its record, or the record has none.
    pub(crate) states: Vec<Option<DMatrix<f64>>>,
}

/// A run of the store, and its answer where it had one.
#[derive(Clone, Debug)]
pub(crate) struct KeptRun {
    pub(crate) step: usize,
    pub(crate) record: String,
    pub(crate) particle: u32,
    pub(crate) error: Option<String>,
    pub(crate) answer: Option<Answer>,
}

impl Store {
    /// Gives the table `jobs` of an earlier program its column for answers.
    pub(super) fn add_answers(&self) -> Result<(), StoreError> {
        if !self.has_answers()? {
            self.guard(self.connection.execute_batch("ALTER TABLE jobs ADD COLUMN answer BLOB"))?;
        }
        Ok(())
    }

    fn has_answers(&self) -> Result<bool, StoreError> {
        let columns: Vec<String> =
            self.rows("SELECT name FROM pragma_table_info('jobs')", |row| row.get(0))?;
        Ok(columns.iter().any(|name| name == "answer"))
    }

    /// Rows of an analysis allow for more inputs.
    pub(super) fn allow_inputs(&self, row: &AnalysisRow) {
        let rows = 1 + row.jobs.len() + row.estimates.len() + row.innovations.len();
        self.inputs_allowed.set(self.inputs_allowed.get() + rows * ROW / SHARE);
    }

    /// Keeps what the particles of the next analysis of a filter are given, where it is due and the database has it.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn keep_inputs(&self, now: &Snapshot<Ensemble>) -> Result<(), StoreError> {
        let (pass, step) = (now.figures.pass + 1, now.figures.step);
        let mut parts = vec![(THETA.to_owned(), now.estimate.theta.to_dense())];
        if step == 0 {
            let columns = [now.estimate.centre.as_slice(), &now.estimate.scale].concat();
            parts.push((START.to_owned(), DMatrix::from_vec(now.estimate.centre.len(), 2, columns)));
        }
        for (record, states) in now.states.iter().enumerate() {
            match states {
                None => {}
                Some(States::Dense(x)) => parts.push((format!("{STATE}{record}"), x.clone())),
                Some(States::Stored(_)) => return Ok(()),
            }
        }
        let bytes: usize = parts.iter().map(|(_, x)| x.len() * size_of::<f64>() + ROW).sum();
        if step > 0 && bytes > self.inputs_allowed.get() {
            return Ok(());
        }
        self.inputs_allowed.set(0);
        // All or none of them, also where no transaction is open.
        self.guard(self.connection.execute_batch("SAVEPOINT inputs"))?;
        let written = parts.iter().try_for_each(|(part, x)| self.write_input((pass, step), part, x));
        let end = if written.is_ok() { "RELEASE inputs" } else { "ROLLBACK TO inputs; RELEASE inputs" };
        // The first failure is returned; a full disk may have ended the transaction already.
        let ended = self.guard(self.connection.execute_batch(end));
        written.and(ended)
    }

    /// Keeps the points of an ensemble of a batch fit.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn keep_points(&self, step: usize, theta: &DMatrix<f64>) -> Result<(), StoreError> {
        self.write_input((1, step), THETA, theta)
    }

    fn write_input(
        &self,
        (pass, step): (usize, usize),
        part: &str,
        x: &DMatrix<f64>,
    ) -> Result<(), StoreError> {
        let sql = "INSERT OR REPLACE INTO inputs VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
        let mut insert = self.guard(self.connection.prepare_cached(sql))?;
        let body = floats::encode(x.as_slice());
        self.guard(insert.execute(params![pass, step, part, x.nrows(), x.ncols(), &body[..]]))?;
        Ok(())
    }

    /// The analyses whose inputs are kept: pass and step, in their order; `None` in a store of a program that kept none.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn kept_inputs(&self) -> Result<Option<Vec<(usize, usize)>>, StoreError> {
        let tables: Vec<String> =
            self.rows("SELECT name FROM sqlite_master WHERE name = 'inputs'", |row| row.get(0))?;
        if tables.is_empty() || !self.has_answers()? {
            return Ok(None);
        }
        let select = format!("SELECT pass, step FROM inputs WHERE part = '{THETA}' ORDER BY pass, step");
        Ok(Some(self.rows(&select, |row| Ok((row.get(0)?, row.get(1)?)))?))
    }

    /// What is kept of the inputs of an analysis of a study with so many records.
    ///
    /// # Errors
    /// When the database refuses or its content is damaged.
    pub(crate) fn inputs(&self, pass: usize, step: usize, n_record: usize) -> Result<Inputs, StoreError> {
        let theta =
            self.input(pass, step, THETA)?.ok_or_else(|| self.damaged("inputs", "parameters are missing"))?;
        let start = self.input(pass, 0, START)?;
        let states = (0..n_record).map(|record| self.input(pass, step, &format!("{STATE}{record}")));
        Ok(Inputs { pass, step, theta, start, states: states.collect::<Result<_, _>>()? })
    }

    fn input(&self, pass: usize, step: usize, part: &str) -> Result<Option<DMatrix<f64>>, StoreError> {
        let of = format!("pass = {pass} AND step = {step} AND part = '{part}'");
        let rows = self.rows(&format!("SELECT rows, columns, body FROM inputs WHERE {of}"), |row| {
            Ok((row.get::<_, usize>(0)?, row.get::<_, usize>(1)?, row.get::<_, Vec<u8>>(2)?))
        })?;
        let Some((n, r, body)) = rows.into_iter().next() else { return Ok(None) };
        let values =
            floats::decode(&body, "inputs").ok().filter(|values| Some(values.len()) == n.checked_mul(r));
        let values = values.ok_or_else(|| self.damaged("inputs", "a matrix of another size"))?;
        Ok(Some(DMatrix::from_vec(n, r, values)))
    }

    /// The runs of the analyses of a pass from one to another, both included, in the order in which they were made.
    ///
    /// # Errors
    /// When the database refuses or its content is damaged.
    pub(crate) fn kept_runs(&self, pass: usize, from: usize, to: usize) -> Result<Vec<KeptRun>, StoreError> {
        let select = format!(
            "SELECT step, record, particle, error, answer FROM jobs WHERE pass = {pass} AND step BETWEEN {from} AND {to} ORDER BY id"
        );
        let rows = self.rows(&select, |row| {
            let answer: Option<Vec<u8>> = row.get(4)?;
            let (step, record, particle) = (row.get(0)?, row.get(1)?, row.get(2)?);
            Ok((KeptRun { step, record, particle, error: row.get(3)?, answer: None }, answer))
        })?;
        let read = |(run, bytes): (KeptRun, Option<Vec<u8>>)| {
            let read = |bytes: Vec<u8>| {
                Answer::from_bytes(&bytes).ok_or_else(|| self.damaged("run", "an answer of another length"))
            };
            Ok(KeptRun { answer: bytes.map(read).transpose()?, ..run })
        };
        rows.into_iter().map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::snapshot::{Figures, Matrix};

    fn at(step: usize) -> Snapshot<Ensemble> {
        let theta = DMatrix::from_fn(2, 3, |i, j| (i + 2 * j + 6 * step) as f64 / 3.0);
        let (centre, scale) = (vec![0.1, 0.2], vec![0.3, 0.4]);
        let estimate = Ensemble {
            theta: Matrix::from(&theta),
            centre,
            scale,
            cost: None,
            narrow: 1.0,
            from_start: None,
        };
        let states = if step == 0 { None } else { Some(DMatrix::from_element(4, 3, step as f64).into()) };
        Snapshot { figures: Figures { step, ..Figures::default() }, estimate, states: vec![None, states] }
    }

    fn row(step: usize) -> AnalysisRow {
        AnalysisRow {
            pass: 1,
            step,
            time: 0.0,
            n_used: 0,
            nis: 0.0,
            log_likelihood: 0.0,
            information_lost: 0.0,
            estimates: Vec::new(),
            innovations: Vec::new(),
            jobs: Vec::new(),
        }
    }

    #[test]
    fn inputs_come_back_bit_by_bit_and_take_the_share_of_the_store_that_they_may() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
        for step in 0..1050 {
            store.keep_inputs(&at(step)).expect("room");
            store.analysis(&row(step), &at(step + 1)).expect("room");
        }
        let kept = store.kept_inputs().expect("readable").expect("a table");
        assert_eq!(kept[0], (1, 0), "the first analysis of a pass is always kept");
        // 254 bytes a time, 1 byte of room with every analysis of one row.
        let apart: Vec<usize> = kept.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
        assert_eq!(apart, [254, 254, 254, 254]);
        let (_, step) = kept[2];
        let read = store.inputs(1, step, 2).expect("readable");
        assert_eq!(read.theta, at(step).estimate.theta.to_dense());
        assert_eq!(read.start, Some(DMatrix::from_vec(2, 2, vec![0.1, 0.2, 0.3, 0.4])));
        assert_eq!(read.states, [None, Some(DMatrix::from_element(4, 3, step as f64))]);
    }

    #[test]
    fn a_store_of_a_program_that_kept_none_says_so_and_gets_a_place_for_them_when_it_is_continued() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.db");
        let store = Store::create(&path, &[]).expect("a store");
        let older = "DROP TABLE inputs; ALTER TABLE jobs DROP COLUMN answer";
        store.connection.execute_batch(older).expect("as it was before");
        assert_eq!(store.kept_inputs().expect("readable"), None);
        drop(store);
        assert_eq!(Store::open(&path).expect("a store").kept_inputs().expect("readable"), Some(Vec::new()));
    }
}
