//! From a Gaussian in transformed units to medians and intervals in physical units.
//!
//! A median and a central interval are exact under a monotone transform; the standard deviation in physical units is the
//! first-order one, |dv/dθ|·sd.

use serde::{Deserialize, Serialize};
use starlings_estimators::quantiles::Z95;
use starlings_estimators::{Gaussian, Transform};

use super::store::EstimateRow;
use super::{Study, ThetaEntry};

/// One estimated parameter in physical units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Name in the estimated vector, such as `R` or `R[in-vivo-1]`.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Posterior median.
    pub estimate: f64,
    /// Standard deviation, to first order.
    pub sd: f64,
    /// Central 95 % interval at the stated noise.
    pub interval95: [f64; 2],
    /// Half-width of the interval given the residuals over 1.96, to first order as `sd` is; `None` where there is no such
    /// interval.
    #[serde(default)]
    pub sd_given_residuals: Option<f64>,
    /// 95 % interval given the residuals: whatever noise was stated, for errors as large and as correlated as those that the
    /// fit leaves. Never narrower than the other.
    #[serde(default)]
    pub interval95_given_residuals: Option<[f64; 2]>,
    /// Prior median.
    pub prior_median: f64,
    /// Prior central 95 % interval.
    pub prior_interval95: [f64; 2],
}

/// The study's prior over the estimated vector, independent entries, transformed units.
pub fn prior(study: &Study) -> Gaussian {
    let mean: Vec<f64> = study.theta.iter().map(|t| t.prior_mean).collect();
    let sd: Vec<f64> = study.theta.iter().map(|t| t.prior_sd).collect();
    independent(&mean, &sd)
}

/// A Gaussian with independent entries.
pub fn independent(mean: &[f64], sd: &[f64]) -> Gaussian {
    use nalgebra::{DMatrix, DVector};
    let variance = DVector::from_iterator(sd.len(), sd.iter().map(|s| s * s));
    Gaussian { mean: DVector::from_column_slice(mean), covariance: DMatrix::from_diagonal(&variance) }
}

/// Estimates in physical units, in the order of the estimated vector.
pub fn estimates(study: &Study, posterior: &Gaussian) -> Vec<Estimate> {
    let sd = standard_deviations(posterior);
    study
        .theta
        .iter()
        .enumerate()
        .map(|(j, entry)| {
            let mean = posterior.mean[j];
            Estimate {
                name: entry.name.clone(),
                unit: entry.unit(study).to_owned(),
                estimate: entry.transform.to_physical(mean),
                sd: entry.transform.derivative(mean).abs() * sd[j],
                interval95: interval(&entry.transform, mean, Z95 * sd[j]),
                sd_given_residuals: None,
                interval95_given_residuals: None,
                prior_median: entry.transform.to_physical(entry.prior_mean),
                prior_interval95: interval(&entry.transform, entry.prior_mean, Z95 * entry.prior_sd),
            }
        })
        .collect()
}

/// Adds the intervals given the residuals, which are so many times wider in transformed units.
pub(super) fn widen(study: &Study, posterior: &Gaussian, estimates: &mut [Estimate], factors: &[f64]) {
    let sd = standard_deviations(posterior);
    for (j, (estimate, factor)) in estimates.iter_mut().zip(factors).enumerate() {
        let transform = &study.theta[j].transform;
        estimate.sd_given_residuals = Some(estimate.sd * factor);
        estimate.interval95_given_residuals =
            Some(interval(transform, posterior.mean[j], Z95 * sd[j] * factor));
    }
}

/// Rows for the store: median and the band of two standard deviations.
pub fn rows(study: &Study, posterior: &Gaussian) -> Vec<EstimateRow> {
    let sd = standard_deviations(posterior);
    study
        .theta
        .iter()
        .enumerate()
        .map(|(j, entry)| {
            let mean = posterior.mean[j];
            let [lo, hi] = interval(&entry.transform, mean, 2.0 * sd[j]);
            let estimate = entry.transform.to_physical(mean);
            EstimateRow { parameter: entry.name.clone(), estimate, lo, hi, mean, sd: sd[j] }
        })
        .collect()
}

/// Square roots of the variances; a variance rounded below zero counts as zero.
pub(crate) fn standard_deviations(gaussian: &Gaussian) -> Vec<f64> {
    gaussian.covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
}

fn interval(transform: &Transform, mean: f64, half_width: f64) -> [f64; 2] {
    // An interval beyond the largest number ends there: infinity does not survive JSON.
    [-half_width, half_width].map(|w| transform.to_physical(mean + w).clamp(f64::MIN, f64::MAX))
}

impl ThetaEntry {
    /// Unit label of the parameter this entry belongs to.
    pub fn unit<'a>(&self, study: &'a Study) -> &'a str {
        &study.parameters[self.parameter].unit
    }
}

/// The posterior as CSV: one row per parameter with its estimate, then its row of the covariance in transformed units.
/// Every number is written with the digits that identify it exactly.
///
/// # Errors
/// Never in practice: the text is written to memory.
pub(crate) fn to_csv(study: &Study, posterior: &Gaussian) -> Result<String, csv::Error> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let fixed = ["parameter", "unit", "transform", "estimate", "sd", "lo95", "hi95", "mean_transformed"];
    let covariances = study.theta.iter().map(|entry| format!("cov:{}", entry.name));
    csv.write_record(fixed.map(str::to_owned).into_iter().chain(covariances))?;
    for (j, e) in estimates(study, posterior).into_iter().enumerate() {
        let numbers = [e.estimate, e.sd, e.interval95[0], e.interval95[1], posterior.mean[j]];
        let row = posterior.covariance.row(j);
        let text = [e.name, e.unit, study.theta[j].transform.to_string()];
        csv.write_record(text.into_iter().chain(numbers.iter().chain(row.iter()).map(|v| format!("{v:?}"))))?;
    }
    let bytes = csv.into_inner().map_err(csv::IntoInnerError::into_error)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
