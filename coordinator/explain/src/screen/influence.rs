//! What a candidate would change, row by row: held where the influences of a screening are small together, else worked out again
//! from the runs that the store keeps.
//!
//! Both ways give the same bits. Next file to read: [`super::screening`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_study::store::RunKey;

use crate::error::ExplainError;
use crate::rows::Row;
use crate::run_cache::RunCache;

/// d prediction / d amplitude over the noise, all rows.
#[derive(Clone, Debug)]
pub(crate) enum Influence {
    /// It is held.
    Held(Arc<DVector<f64>>),
    /// It is worked out when it is asked for.
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
    /// Of what has none.
    pub(crate) fn none() -> Self {
        Self::Held(Arc::new(DVector::zeros(0)))
    }

    /// The values.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn sensitivity(&self, cache: &RunCache<'_>) -> Result<Arc<DVector<f64>>, ExplainError> {
        match self {
            Self::Held(sensitivity) => Ok(Arc::clone(sensitivity)),
            Self::Remembered { runs, amplitude, base } => {
                let predicted = cache.recall(runs)?.unwrap_or_default();
                Ok(Arc::new(difference(&cache.rows.rows, &predicted, base, *amplitude)))
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

/// The change from `base` to `predicted` per amplitude, over the noise.
pub(crate) fn difference(rows: &[Row], predicted: &[f64], base: &[f64], amplitude: f64) -> DVector<f64> {
    let change = predicted.iter().zip(base).zip(rows);
    let change = change.map(|((y, b), row)| (y - b) / (row.noise * amplitude));
    DVector::from_iterator(rows.len(), change)
}
