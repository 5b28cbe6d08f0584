//! The posterior that a finished run left in its store.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::Gaussian;

use super::StudyForecastError;
use crate::{RunFolder, Study};

/// Columns before the covariances, as [`crate::posterior::to_csv`] writes them.
const FIXED: usize = 8;

/// The posterior in transformed units, in the order of the estimated vector.
///
/// # Errors
/// When the run is not finished, or its posterior is not that of this study.
pub(super) fn read(study: &Study, folder: &RunFolder) -> Result<Gaussian, StudyForecastError> {
    let shown = folder.path.display();
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
