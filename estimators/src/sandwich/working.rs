//! The variance of the estimate for errors of a given form: white noise plus a part whose correlation decays exponentially.
//!
//! Each channel of a record has errors w + x, w white and x an autoregression of first order in continuous time; its correlation
//! time and share are not estimated but averaged over, by the restricted likelihood of the residuals, which accounts for the
//! part of them that the parameters have fitted (Patterson & Thompson 1971; for autoregressive errors Cooper & Thompson 1977).
//! The estimate stays that of the stated noise: the covariance is a working one (Liang & Zeger 1986). Where errors of channels
//! are correlated, their innovations give the factor by which that widens the sum. Not used where it would take more than about
//! a second. Read next: `filter.rs`.

pub(super) mod filter;

use nalgebra::DVector;

use super::{Record, Series};
use filter::{Filtered, Form};

/// Probability before the data that the errors of a channel are white.
const WHITE: f64 = 0.95;
/// Correlation times tried, from half a sampling interval to the length of the record.
const N_TIME: usize = 14;
/// Shares of white noise tried in the variance of the errors.
const SHARES: [f64; 6] = [1e-4, 0.03, 0.1, 0.25, 0.5, 0.75];
/// Forms with less than this probability are left out.
const NEGLIGIBLE: f64 = 1e-6;
/// Residuals of a channel below which their correlation is not estimated.
const FEWEST: usize = 8;
/// Residuals times squared number of columns beyond which this file is not used.
const LARGEST: f64 = 1e7;

/// The result over all forms of the errors.
pub(super) struct Working {
    /// Variance of each parameter in squared prior sd, length p.
    pub(super) variance: DVector<f64>,
    /// Probability that the errors of every channel are white.
    pub(super) white: f64,
}

/// The variance for errors of these forms; `None` when that would take too long.
pub(super) fn working(records: &[Record]) -> Option<Working> {
    let series = || records.iter().flat_map(|record| &record.series);
    let p = series().next()?.influence.ncols();
    let n: usize = series().map(|series| series.residual.len()).sum();
    if n as f64 * ((p + 1) * (p + 1)) as f64 > LARGEST {
        return None;
    }
    let mut sum = Working { variance: DVector::zeros(p), white: 1.0 };
    for record in records {
        let of_record = of_record(record, p);
        sum.variance += of_record.variance;
        sum.white *= of_record.white;
    }
    Some(sum)
}

/// The channels of a record, with the factor by which correlation between channels widens their sum.
fn of_record(record: &Record, p: usize) -> Working {
    let mut sum = Working { variance: DVector::zeros(p), white: 1.0 };
    let mut joint = vec![DVector::<f64>::zeros(p); record.n_time];
    let mut alone = DVector::<f64>::zeros(p);
    for series in &record.series {
        let best = average(series, &mut sum);
        for ((step, innovation), influence) in series.step.iter().zip(&best.innovation).zip(&best.influence) {
            let moved = influence * *innovation;
            alone += moved.component_mul(&moved);
            joint[*step] += moved;
        }
    }
    let mut together = DVector::<f64>::zeros(p);
    for moved in &joint {
        together += moved.component_mul(moved);
    }
    for j in 0..p {
        let ratio = together[j] / alone[j];
        if ratio > 1.0 && record.series.len() > 1 {
            sum.variance[j] *= ratio;
        }
    }
    sum
}

/// Adds the variance of one channel, averaged over the forms; returns the channel filtered by the likeliest.
fn average(series: &Series, sum: &mut Working) -> Filtered {
    let forms = forms(series);
    let white = Filtered::new(series, &forms[0]);
    if !(series.residual.iter().any(|v| v.abs() > 0.0)) {
        return white;
    }
    let of_forms: Vec<(f64, f64)> = forms.iter().map(|form| filter::deviance(series, form)).collect();
    let least = of_forms.iter().map(|(deviance, _)| *deviance).fold(f64::INFINITY, f64::min);
    let before = |k: usize| if k == 0 { WHITE } else { (1.0 - WHITE) / (forms.len() - 1) as f64 };
    let weights: Vec<f64> = of_forms
        .iter()
        .enumerate()
        .map(|(k, (deviance, _))| {
            let weight = before(k) * (-0.5 * (deviance - least)).exp();
            if weight.is_finite() { weight } else { 0.0 }
        })
        .collect();
    let whole: f64 = weights.iter().sum();
    if whole.is_nan() || whole <= 0.0 {
        return white;
    }
    sum.white *= weights[0] / whole;
    let mut likeliest = (0.0, 0);
    for (k, form) in forms.iter().enumerate().filter(|(k, _)| weights[*k] > NEGLIGIBLE * whole) {
        let filtered = Filtered::new(series, form);
        sum.variance.axpy(weights[k] / whole * of_forms[k].1, &filtered.variance(), 1.0);
        if weights[k] > likeliest.0 {
            likeliest = (weights[k], k);
        }
    }
    Filtered::new(series, &forms[likeliest.1])
}

/// White errors first, then every correlation time with every share.
fn forms(series: &Series) -> Vec<Form> {
    let mut forms = vec![Form { time: 1.0, white: 1.0 }];
    let n = series.time.len();
    let span = series.time[n - 1] - series.time[0];
    if n < FEWEST || span.is_nan() || span <= 0.0 {
        return forms;
    }
    let shortest = 0.5 * span / (n - 1) as f64;
    for k in 0..N_TIME {
        let time = shortest * (span / shortest).powf(k as f64 / (N_TIME - 1) as f64);
        forms.extend(SHARES.map(|white| Form { time, white }));
    }
    forms
}
