//! How the training residuals of a fit compare with the stated noise, in figures and in words.
//!
//! Every sentence of an explanation about noise is made here or in [`super::held_out`], from the figures that it stands beside.
//! Next file to read: [`crate::tell::words`].

use nalgebra::DVector;
use starlings_estimators::nis_band_of_uncertain_noise;

use super::effective_noise::{inflation, whiteness};
use crate::fit::fitted_variant::FittedVariant;
use crate::number::{three, times};
use crate::rows::{Rows, Usage};
use crate::run_cache::RunCache;

/// Residuals are not white if the probability of as large an autocorrelation in white ones is below this.
pub(crate) const NOT_WHITE: f64 = 1e-3;
/// Mean squares over the noise variance that count as the stated noise; a wider interval where chance allows it.
pub(crate) const AS_STATED: [f64; 2] = [0.5, 1.5];
/// Probability of the band in which chance leaves a mean square.
const LEVEL: f64 = 0.999;
/// The same where it is only asked how probable it is that something is left.
const DOUBTED: f64 = 0.95;
/// Share of a signal's spread below which residuals are attributed to the integration or to rounding.
const NUMERICAL: f64 = 1e-6;

/// The training residuals of a fit against the stated noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Adequacy {
    /// Number of fitted values.
    pub n: usize,
    /// Root mean square over the stated noise.
    pub rmse_over_noise: f64,
    /// Probability of residuals at least as autocorrelated if they were white; `None` where no series is long enough to tell.
    pub whiteness: Option<f64>,
    /// Factor on the variance of a smooth signal's coefficient by the size and correlation of the residuals.
    pub inflation: f64,
    /// Root mean square over the spread of the recorded values; infinite where these do not vary.
    pub over_spread: f64,
    /// Degrees of freedom with which the variance of the noise is known: infinite where the study gives it.
    pub noise_freedom: f64,
}

/// How the residuals compare with the stated noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Nature {
    /// Nothing is fitted.
    Nothing,
    /// Of the size of the noise, and not shown to be correlated.
    Noise,
    /// Correlated in time.
    Correlated,
    /// Larger than the stated noise, and not shown to be correlated.
    Larger,
    /// Smaller than the stated noise, and not shown to be correlated.
    Smaller,
    /// Correlated in time, but no larger than the stated noise, and so that smooth signals stand out of them as of white noise.
    Hidden,
}

impl Adequacy {
    /// The figures of a fit.
    pub(crate) fn of(cache: &RunCache<'_>, fit: &FittedVariant<'_>) -> Self {
        Self::of_residual(&cache.rows, fit.residual())
    }

    /// The figures of what is predicted, with the noise of these rows.
    pub(crate) fn of_rows(rows: &Rows, predicted: &[f64]) -> Self {
        Self::of_residual(rows, &rows.train_residual(predicted))
    }

    fn of_residual(rows: &Rows, residual: &DVector<f64>) -> Self {
        let n = rows.train.len();
        let observed: Vec<(f64, f64)> = rows.stretches().into_iter().fold(Vec::new(), |mut all, stretch| {
            let of = &rows.rows[stretch];
            let mean = of.iter().map(|row| row.observed).sum::<f64>() / of.len() as f64;
            all.extend(of.iter().map(|row| ((row.observed - mean) / row.noise, row.noise)));
            all
        });
        let spread = rows.train.iter().map(|i| observed[*i].0.powi(2)).sum::<f64>();
        let squares = residual.norm_squared();
        Self {
            n,
            rmse_over_noise: (squares / n.max(1) as f64).sqrt(),
            whiteness: whiteness(rows, residual),
            inflation: inflation(rows, residual),
            over_spread: if spread > 0.0 { (squares / spread).sqrt() } else { f64::INFINITY },
            noise_freedom: rows.noise_freedom(|row| row.usage == Usage::Train),
        }
    }

    /// How the residuals compare with the stated noise. Larger or smaller than it are residuals beyond both what chance leaves, in them
    /// and in a noise that was found, and [`AS_STATED`].
    pub(crate) fn nature(&self) -> Nature {
        if self.n == 0 {
            return Nature::Nothing;
        }
        let square = self.rmse_over_noise.powi(2);
        if self.whiteness.is_some_and(|p| p < NOT_WHITE) {
            // No larger than the noise, and smooth signals are known in them no worse than in white noise: correlation between neighbours alone.
            let hidden = self.inflation <= 1.0 && square <= 1.0;
            return if hidden { Nature::Hidden } else { Nature::Correlated };
        }
        let (lo, hi) = self.band(LEVEL);
        if square > hi.max(AS_STATED[1]) {
            Nature::Larger
        } else if square < lo.min(AS_STATED[0]) {
            Nature::Smaller
        } else {
            Nature::Noise
        }
    }

    /// The mean squares over the noise variance that chance leaves.
    fn band(&self, level: f64) -> (f64, f64) {
        nis_band_of_uncertain_noise(self.n, self.noise_freedom, level)
    }

    /// Whether the residuals are white, or their correlation is one that the stated noise covers.
    pub(crate) fn could_be_white(&self) -> bool {
        self.nature() != Nature::Correlated
    }

    /// Whether the recorded values of every fitted channel of every record are constant.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.n > 1 && self.over_spread.is_infinite()
    }

    /// Whether the residuals show that something is missing: they are correlated or larger than the stated noise.
    pub(crate) fn is_gap(&self) -> bool {
        matches!(self.nature(), Nature::Correlated | Nature::Larger)
    }

    /// Whether they show that the model lacks something, and not the errors of its simulation or the digits of a file.
    pub(crate) fn is_gap_of_the_model(&self) -> bool {
        self.is_gap() && !self.is_numerical()
    }

    /// Whether a gap shows, or the residuals are at least larger than chance leaves them.
    pub(crate) fn may_hide_a_gap(&self) -> bool {
        self.is_gap() || (self.n > 0 && self.rmse_over_noise.powi(2) > self.band(DOUBTED).1)
    }

    /// The comparison as a sentence without capital and full stop.
    pub(crate) fn says(&self) -> String {
        let size = times(self.rmse_over_noise);
        let at_rest = if self.is_at_rest() {
            "; the recorded values do not vary, and data at rest tell little"
        } else {
            ""
        };
        format!("{}{at_rest}", self.compared(&size))
    }

    /// How the residuals compare with the stated noise, in words.
    fn compared(&self, size: &str) -> String {
        if self.is_numerical() {
            return format!(
                "the residuals are {size} the stated noise and only {} of the recorded signal's spread: so small a difference is \
                 the error of integration or of the digits of the recording, and the stated noise is smaller than that",
                three(self.over_spread)
            );
        }
        let untested = self.whiteness.is_none();
        let white = if untested {
            "too few in a row, or too little varied, to tell whether they are correlated"
        } else {
            "with no sign of correlation in time"
        };
        match self.nature() {
            Nature::Nothing => "no value is fitted".to_owned(),
            Nature::Noise if untested => format!("the residuals are {size} the stated noise, {white}"),
            Nature::Noise => {
                format!("the residuals are {size} the stated noise, {white}: they could be noise")
            }
            Nature::Larger => format!(
                "the residuals are {size} the stated noise, {white}: the noise is larger than stated, or what is missing changes \
                 from sample to sample"
            ),
            Nature::Smaller => format!(
                "the residuals are {size} the stated noise, {white}: the noise is smaller than stated, and what lies below the \
                 stated one cannot show"
            ),
            Nature::Hidden => format!(
                "the residuals are {size} the stated noise and correlated in time, but the stated noise alone would hide as much"
            ),
            Nature::Correlated => format!("the residuals are {size} the stated noise and correlated in time"),
        }
    }

    /// Whether the residuals are no larger than what the simulation itself or the digits of a file leave.
    pub(crate) fn is_numerical(&self) -> bool {
        self.over_spread < NUMERICAL && self.rmse_over_noise > 1.0 && self.is_gap()
    }
}

#[cfg(test)]
mod tests;
