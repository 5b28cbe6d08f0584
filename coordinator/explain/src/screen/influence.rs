//! The influence of a candidate on the predictions, row by row.
//!
//! It is held in memory where all influences of a screening fit there, and else computed again from the runs in the store. Both
//! ways give the same bits. Next file to read: [`super::screening`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_study::store::RunKey;

use crate::error::ExplainError;
use crate::rows::Rows;
use crate::run_cache::RunCache;

/// d prediction / d amplitude, whitened, all rows.
#[derive(Clone, Debug)]
pub(crate) enum Influence {
    /// Held in memory.
    Held(Arc<DVector<f64>>),
    /// Computed from remembered runs when it is asked for.
    Remembered {
        /// The runs with the candidate, one per record.
        runs: Arc<[RunKey]>,
        /// Its amplitude in them.
        amplitude: f64,
        /// What the model predicts without it.
        base: Arc<Vec<f64>>,
    },
}

impl Influence {
    /// The influence of a candidate without one.
    pub(crate) fn none() -> Self {
        Self::Held(Arc::new(DVector::zeros(0)))
    }

    /// The values, all rows.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn sensitivity(&self, cache: &RunCache<'_>) -> Result<Arc<DVector<f64>>, ExplainError> {
        match self {
            Self::Held(sensitivity) => Ok(Arc::clone(sensitivity)),
            Self::Remembered { runs, amplitude, base } => {
                let predicted = cache.recall(runs)?.unwrap_or_default();
                Ok(Arc::new(difference(&cache.rows, &predicted, base, *amplitude)))
            }
        }
    }

    /// The values of the rows that train.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn of_train(&self, cache: &RunCache<'_>) -> Result<DVector<f64>, ExplainError> {
        Ok(self.sensitivity(cache)?.select_rows(&cache.rows.train))
    }
}

/// The change from `base` to `predicted` per amplitude, whitened.
pub(crate) fn difference(rows: &Rows, predicted: &[f64], base: &[f64], amplitude: f64) -> DVector<f64> {
    let change = predicted.iter().zip(base).zip(&rows.rows);
    let change = change.map(|((y, b), row)| (y - b) / (row.noise * amplitude));
    let mut difference = DVector::from_iterator(rows.rows.len(), change);
    rows.whiten(0, difference.as_mut_slice());
    difference
}
