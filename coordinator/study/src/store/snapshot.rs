//! What a killed run continues from: the state of the estimator and of every particle after the last analysis.
//!
//! Small values are one JSON text, states are little-endian f64 blobs, so a resumed run sees the same bits. Of states in the store of
//! the fleet the database has the names of their pieces, which stand in the run folder ([`super::kept_states`]). Next file to read:
//! [`crate::run`].

use nalgebra::DMatrix;
use rusqlite::{Connection, OptionalExtension, params};
use serde::{Deserialize, Serialize};
use starlings_estimators::{BatchState, FromStart, Gaussian};
use starlings_fleet::{StateStore, StoredState};
use starlings_proto::convert::floats;

use crate::failures::Failures;
use crate::states::States;
use crate::states::stored::StoredStates;
use crate::store::{Store, StoreError};

/// A column-major matrix as plain data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Matrix {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Entries, column by column.
    pub values: Vec<f64>,
}

impl From<&DMatrix<f64>> for Matrix {
    fn from(m: &DMatrix<f64>) -> Self {
        Self { rows: m.nrows(), columns: m.ncols(), values: m.as_slice().to_vec() }
    }
}

impl Matrix {
    /// The matrix as a nalgebra matrix.
    pub fn to_dense(&self) -> DMatrix<f64> {
        DMatrix::from_column_slice(self.rows, self.columns, &self.values)
    }
}

/// Counts that the summary reports, carried over a resume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Runs asked of the fleet.
    pub total: u64,
    /// Runs that failed for good.
    pub failed: u64,
    /// Extra attempts.
    pub retried: u64,
    /// Sigma points that were pulled towards the mean, or dropped, and so rescued their analysis.
    pub rescued: u64,
}

impl Counts {
    /// Adds the runs that a runner made between two of its counts.
    pub(crate) fn add_since(&mut self, before: Self, now: Self) {
        self.total += now.total - before.total;
        self.failed += now.failed - before.failed;
        self.retried += now.retried - before.retried;
    }
}

/// What every estimator keeps between two analyses: where it stands, and the figures of the pass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Pass, from 0.
    pub pass: usize,
    /// Analyses done in this pass, or iterations of the batch estimator.
    pub step: usize,
    /// Sum of NIS over this pass.
    pub nis: f64,
    /// Observations used in this pass.
    pub n_used: usize,
    /// Log-likelihood of this pass.
    pub log_likelihood: f64,
    /// Largest share of the spread lost at one analysis, over all passes.
    pub information_lost: f64,
    /// Largest share of the spread that a resampling left out, over all passes.
    pub dropped: f64,
    /// Runs so far.
    pub counts: Counts,
    /// How they ended and where they lie.
    #[serde(default)]
    pub failures: Failures,
}

/// The particles of a filter, and where its pass started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// Transformed parameters, p × r.
    pub theta: Matrix,
    /// Mean of the prior that this pass started from, transformed units.
    pub centre: Vec<f64>,
    /// Its standard deviations.
    pub scale: Vec<f64>,
    /// Cost of a run at `centre`, where it is known: squared misfit plus squared distance from the prior.
    pub cost: Option<f64>,
    /// Factor on the width of the points of this pass.
    pub narrow: f64,
    /// In a pass with drift, what it says of where it started.
    #[serde(default)]
    pub from_start: Option<Box<FromStart>>,
}

/// All that a batch fit knows after an ensemble; what a killed run continues from, or ends with if it was the last one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// What the next ensemble is made from.
    pub state: BatchState,
    /// The posterior around the best centre.
    pub posterior: Gaussian,
}

/// What an estimator continues from, by the form of the estimator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimate {
    /// A filter, whatever its kind.
    Filter(Ensemble),
    /// A batch fit.
    Batch(Box<Iteration>),
}

impl From<Ensemble> for Estimate {
    fn from(ensemble: Ensemble) -> Self {
        Self::Filter(ensemble)
    }
}

impl From<Iteration> for Estimate {
    fn from(iteration: Iteration) -> Self {
        Self::Batch(Box::new(iteration))
    }
}

/// The row of the store beside the states.
#[derive(Serialize, Deserialize)]
struct Head {
    #[serde(flatten)]
    figures: Figures,
    estimate: Estimate,
}

/// An estimator between two analyses, with the states of its particles.
#[derive(Clone, Debug)]
pub struct Snapshot<E = Estimate> {
    /// Where it stands.
    pub figures: Figures,
    /// What it continues from.
    pub estimate: E,
    /// The states of the particles, by record; `None` before its first window and after its last.
    pub states: Vec<Option<States>>,
}

impl<E: Clone + Into<Estimate>> Snapshot<E> {
    pub(crate) fn write(&self, connection: &Connection) -> rusqlite::Result<()> {
        let head = Head { figures: self.figures.clone(), estimate: self.estimate.clone().into() };
        let head =
            serde_json::to_string(&head).map_err(|e| rusqlite::Error::ToSqlConversionFailure(Box::new(e)))?;
        connection
            .prepare_cached("INSERT OR REPLACE INTO snapshot (id, head) VALUES (1, ?1)")?
            .execute(params![head])?;
        connection.prepare_cached("DELETE FROM snapshot_states")?.execute([])?;
        connection.prepare_cached("DELETE FROM snapshot_pieces")?.execute([])?;
        for (record, states) in self.states.iter().enumerate() {
            match states {
                None => {}
                Some(States::Dense(x)) => {
                    connection
                        .prepare_cached("INSERT INTO snapshot_states VALUES (?1, ?2, ?3, ?4)")?
                        .execute(params![record, x.nrows(), x.ncols(), &floats::encode(x.as_slice())[..]])?;
                }
                Some(States::Stored(x)) => {
                    let mut insert =
                        connection.prepare_cached("INSERT INTO snapshot_pieces VALUES (?1, ?2, ?3, ?4)")?;
                    for (particle, state) in x.columns().iter().enumerate() {
                        let names = state.pieces().as_flattened();
                        insert.execute(params![record, particle, state.n_state(), names])?;
                    }
                }
            }
        }
        Ok(())
    }

    /// The states that it needs in the store.
    pub(super) fn stored(&self) -> Vec<StoredState> {
        let stored = self.states.iter().flatten().filter_map(|states| match states {
            States::Stored(states) => Some(states.columns()),
            States::Dense(_) => None,
        });
        stored.flatten().cloned().collect()
    }
}

impl Snapshot {
    /// Sigma points that were rescued up to the last stored analysis, whichever program stored it.
    ///
    /// # Errors
    /// When the database refuses or its content is damaged.
    pub fn rescued(store: &Store) -> Result<u64, StoreError> {
        #[derive(Deserialize)]
        struct Counted {
            counts: Counts,
        }
        let heads: Vec<String> = store.rows("SELECT head FROM snapshot", |r| r.get(0))?;
        let Some(head) = heads.first() else { return Ok(0) };
        let counted: Counted = serde_json::from_str(head).map_err(|e| store.damaged("snapshot", e))?;
        Ok(counted.counts.rescued)
    }

    /// The last snapshot of a run, if an analysis was stored; `n_record` is the number of records of the study. Large states are those
    /// that `kept` has in its folder.
    ///
    /// # Errors
    /// When the database refuses, its content is damaged, or a piece of a state is missing.
    pub fn read(store: &Store, n_record: usize, kept: &StateStore) -> Result<Option<Self>, StoreError> {
        let head: Option<String> = store.guard(
            store.connection().query_row("SELECT head FROM snapshot", [], |row| row.get(0)).optional(),
        )?;
        let Some(head) = head else { return Ok(None) };
        let head: Head = serde_json::from_str(&head).map_err(|e| store.damaged("snapshot", e))?;
        let mut states = vec![None; n_record];
        let mut select = store
            .guard(store.connection().prepare("SELECT record, rows, columns, body FROM snapshot_states"))?;
        let rows = store.guard(select.query_map([], |row| {
            Ok((
                row.get::<_, usize>(0)?,
                row.get::<_, usize>(1)?,
                row.get::<_, usize>(2)?,
                row.get::<_, Vec<u8>>(3)?,
            ))
        }))?;
        for row in rows {
            let (record, n, r, body) = store.guard(row)?;
            let values = floats::decode(&body, "states").ok().filter(|values| values.len() == n * r);
            let slot =
                states.get_mut(record).ok_or_else(|| store.damaged("snapshot", "an unknown record"))?;
            let values = values.ok_or_else(|| store.damaged("snapshot", "a state of the wrong length"))?;
            *slot = Some(DMatrix::from_column_slice(n, r, &values).into());
        }
        for (record, n_state, columns) in store.kept_states(kept)? {
            let slot =
                states.get_mut(record).ok_or_else(|| store.damaged("snapshot", "an unknown record"))?;
            *slot = Some(States::Stored(StoredStates::of(n_state, columns)));
        }
        Ok(Some(Self { figures: head.figures, estimate: head.estimate, states }))
    }

    /// The same of a filter.
    ///
    /// # Errors
    /// When it is of a batch fit.
    pub(crate) fn of_filter(self, store: &Store) -> Result<Snapshot<Ensemble>, StoreError> {
        match self.estimate {
            Estimate::Filter(estimate) => {
                Ok(Snapshot { figures: self.figures, estimate, states: self.states })
            }
            Estimate::Batch(_) => Err(store.damaged("snapshot", "of a batch fit, and a filter continues")),
        }
    }

    /// The same of a batch fit.
    ///
    /// # Errors
    /// When it is of a filter.
    pub(crate) fn of_batch(self, store: &Store) -> Result<Snapshot<Iteration>, StoreError> {
        match self.estimate {
            Estimate::Batch(estimate) => {
                Ok(Snapshot { figures: self.figures, estimate: *estimate, states: self.states })
            }
            Estimate::Filter(_) => Err(store.damaged("snapshot", "of a filter, and a batch fit continues")),
        }
    }
}
