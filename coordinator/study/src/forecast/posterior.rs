//! The posterior that a finished run left in its store, and how wide the residuals make it.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::Gaussian;

use super::StudyForecastError;
use crate::store::folder::GIVEN_RESIDUALS;
use crate::{RunFolder, Study};

/// Columns before the covariances, as [`crate::posterior::to_csv`] writes them.
const FIXED: usize = 8;

/// The posterior in transformed units, in the order of the estimated vector.
///
/// # Errors
/// When the run is not finished, or its posterior is not that of this study.
fn read(study: &Study, folder: &RunFolder) -> Result<Gaussian, StudyForecastError> {
    let shown = folder.path.display();
    if let Some(message) = study.lacks_start("a forecast") {
        return Err(StudyForecastError::Request(message));
    }
    let Some(text) = folder.store.meta("posterior")? else {
        let message =
            format!("the run in {shown} is not finished: continue it with `starlings run --resume`");
        return Err(StudyForecastError::Request(message));
    };
    let other = |what: &str| {
        StudyForecastError::Request(format!(
            "the posterior of the run in {shown} {what}: it is of another study, or the file is damaged"
        ))
    };
    let n = study.theta.len();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let (mut mean, mut covariance) = (Vec::with_capacity(n), Vec::with_capacity(n * n));
    for (j, row) in rows.records().enumerate() {
        let row = row.map_err(|_| other("cannot be read"))?;
        let expected = study.theta.get(j).map(|entry| entry.name.as_str());
        if row.get(0) != expected || row.len() != FIXED + n {
            return Err(other(&format!("has `{}` in its row {}", row.get(0).unwrap_or_default(), j + 1)));
        }
        let numbers = row.iter().skip(FIXED - 1).map(str::parse::<f64>);
        let numbers: Vec<f64> =
            numbers.collect::<Result<_, _>>().map_err(|_| other("holds text for a number"))?;
        if !numbers.iter().all(|v| v.is_finite()) {
            return Err(other("holds a number that is not finite"));
        }
        mean.push(numbers[0]);
        covariance.extend_from_slice(&numbers[1..]);
    }
    if mean.len() != n {
        return Err(other(&format!("has {} parameters where the study has {n}", mean.len())));
    }
    Ok(Gaussian { mean: DVector::from_vec(mean), covariance: DMatrix::from_row_slice(n, n, &covariance) })
}

/// What the parameters of the members are drawn from.
pub(super) struct Drawn {
    pub(super) gaussian: Gaussian,
    /// By how many times the sd of a parameter exceeds that at the stated noise, at the most; `None` where the run has no
    /// covariance given the residuals.
    pub(super) wider: Option<f64>,
}

impl Drawn {
    /// The posterior with its covariance given the residuals, where the run has one.
    ///
    /// # Errors
    /// When the run is not finished, or its posterior is not that of this study.
    pub(super) fn read(study: &Study, folder: &RunFolder) -> Result<Self, StudyForecastError> {
        let stated = read(study, folder)?;
        let Some(text) = folder.store.meta(GIVEN_RESIDUALS)? else {
            return Ok(Self { gaussian: stated, wider: None });
        };
        let damaged = |why: &str| folder.store.damaged("covariance given the residuals", why);
        let rows: Vec<Vec<f64>> = serde_json::from_str(&text).map_err(|e| damaged(&e.to_string()))?;
        let n = stated.mean.len();
        if rows.len() != n || rows.iter().any(|row| row.len() != n || row.iter().any(|v| !v.is_finite())) {
            return Err(damaged("it is no table of the study's parameters").into());
        }
        let covariance = DMatrix::from_fn(n, n, |i, j| rows[i][j]);
        let ratio = |j: usize| (covariance[(j, j)] / stated.covariance[(j, j)]).sqrt();
        let wider = (0..n).map(ratio).filter(|ratio| ratio.is_finite()).fold(1.0, f64::max);
        Ok(Self { gaussian: Gaussian { mean: stated.mean, covariance }, wider: Some(wider) })
    }
}
