//! Whether measurement noise matters: white residuals are uncorrelated, differences of measurement noise are not.
//!
//! A step between rows that were measured with errors η has the residual (η_{n+1} − η_n)/h more, so neighbouring residuals share an
//! error: −E r_n r_{n+1} / E r² is 0 for process noise alone and ½ for measurement noise alone. The fit itself makes residuals of
//! few steps anticorrelated, by Σ F_n cov F_{n+1}ᵀ, which is taken away first. Read next: `diffusion.rs`, the noise that holds in
//! spite of it, and `smoother.rs` for when it is large.

use nalgebra::DMatrix;

use super::residual_products::ResidualProducts;
use super::{InferenceError, Posterior, Structure, Sums};
use crate::quantiles::normal;

/// Ratio from which measurement noise moves coefficients by more than their sd in the examples of Smelyanskiy, Luchinsky et al.
pub const MATTERS: f64 = 0.05;
/// Probability with which a verdict is right.
const SURE: f64 = 0.95;
/// Probability with which errors of any size are told to be present.
const PRESENT: f64 = 0.99;

/// Residuals of one equation at lag one.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct NoiseCheck {
    /// The equation.
    pub equation: String,
    /// −E r_n r_{n+1} / E r².
    pub ratio: f64,
    /// Its sampling error (Bartlett 1946).
    pub sd: f64,
    /// Variance of the measurement noise that it means, in the state's unit squared; negative by chance where there is none.
    pub measured: f64,
    /// What follows.
    pub verdict: Verdict,
}

impl NoiseCheck {
    /// Whether there are errors of the measurement at all, large or small: by chance in one of a hundred equations without.
    pub fn is_sure(&self) -> bool {
        self.ratio > normal(PRESENT) * self.sd
    }

    /// The memory of the noise in steps where neighbouring residuals are alike: the time in which their correlation falls to 1/e, were it that
    /// of an Ornstein–Uhlenbeck process.
    pub fn memory(&self) -> Option<f64> {
        (self.verdict == Verdict::Alike && self.ratio > -1.0).then(|| -1.0 / (-self.ratio).ln())
    }

    /// The sampling error of [`Self::measured`], in the same unit; `None` where residuals at lag one are none at all.
    pub fn measured_sd(&self) -> Option<f64> {
        let sd = self.sd * self.measured / self.ratio;
        (sd.is_finite() && sd > 0.0).then_some(sd)
    }

    /// The same with a sampling error that is so many times as large, as where the noise is not constant.
    #[must_use]
    pub fn widened(self, times: f64) -> Self {
        let sd = self.sd * times;
        Self { sd, verdict: verdict(self.ratio, sd), ..self }
    }
}

/// What residuals at lag one say, with 95 % probability.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Measurement noise matters: take D from lagged residuals, or smooth.
    Matters,
    /// It does not.
    Absent,
    /// Neighbouring residuals are alike: the noise has a memory, or what the drift lacks, and no measurement noise shows.
    Alike,
    /// There are too few steps to say.
    Unclear,
}

/// Looks at every equation's residuals at lag one.
///
/// # Errors
/// `Shape`; `TooFew` without a pair of neighbouring steps.
pub fn noise_checks(
    sums: &Sums,
    structure: &Structure,
    posterior: &Posterior,
) -> Result<Vec<NoiseCheck>, InferenceError> {
    structure.fits(sums.n_state(), sums.n_function())?;
    if sums.n_pair() == 0 {
        let equation = structure.equations().first().cloned().unwrap_or_default();
        return Err(InferenceError::TooFew { n_step: sums.n_step(), n_unknown: 0, equation });
    }
    let products = ResidualProducts::of(sums, structure, posterior);
    let (squares, lagged) = (products.squares(), products.lagged());
    let (n, pairs) = (sums.n_step() as f64, sums.n_pair() as f64);
    let check = |(l, equation): (usize, &String)| {
        let shared = -lagged[(l, l)] / pairs;
        let ratio = shared / (squares[(l, l)] / n);
        let sd = bartlett_sd(ratio, pairs);
        let measured = shared * sums.step() * sums.step();
        NoiseCheck { equation: equation.clone(), ratio, sd, measured, verdict: verdict(ratio, sd) }
    };
    Ok(structure.equations().iter().enumerate().map(check).collect())
}

fn verdict(ratio: f64, sd: f64) -> Verdict {
    let margin = normal(SURE) * sd;
    match ratio - MATTERS {
        _ if ratio < -MATTERS - margin => Verdict::Alike,
        above if above > margin => Verdict::Matters,
        above if above < -margin => Verdict::Absent,
        _ => Verdict::Unclear,
    }
}

/// Standard deviation of a lag-one autocorrelation from so many pairs, of a moving average of order one (Bartlett, Journal of the Royal
/// Statistical Society B 1946).
fn bartlett_sd(ratio: f64, pairs: f64) -> f64 {
    let squared = ratio * ratio;
    ((1.0 - 3.0 * squared + 4.0 * squared * squared) / pairs).max(0.0).sqrt()
}

/// Errors of the measurement, and how far a state moves between rows, by the lag-one autocovariance of neighbouring differences alone (Roll,
/// Journal of Finance 1984): without a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct IncrementNoise {
    /// The equation.
    pub equation: String,
    /// Share, from 0 to 1, of the variance of a difference that errors of the measurement have: twice −E ẋ_n ẋ_{n+1} / E ẋ².
    pub share: f64,
    /// Standard deviation of these errors, in the state's unit.
    pub measured: f64,
    /// What the state itself moves by in a step, root mean square, in its unit, at most: with 95 % probability.
    pub moves: f64,
}

/// What neighbouring differences of every state say, where there are pairs of steps. A drift that goes far in a step makes them alike, and the
/// share of the errors too small.
pub fn increment_noise(sums: &Sums, structure: &Structure) -> Vec<IncrementNoise> {
    if sums.n_pair() == 0 || sums.n_state() != structure.equations().len() {
        return Vec::new();
    }
    let still = DMatrix::zeros(sums.n_state(), sums.n_function());
    let (squares, lagged) = (sums.q(), sums.lagged_residuals(&still));
    let (n, pairs, h) = (sums.n_step() as f64, sums.n_pair() as f64, sums.step());
    let of = |(l, equation): (usize, &String)| {
        let square = squares[(l, l)] / n;
        let ratio = (-lagged[(l, l)] / pairs / square).clamp(0.0, 0.5);
        let sd = bartlett_sd(ratio, pairs);
        let left = (1.0 - 2.0 * (ratio - normal(SURE) * sd)).min(1.0);
        IncrementNoise {
            equation: equation.clone(),
            share: 2.0 * ratio,
            measured: h * (ratio * square).sqrt(),
            moves: h * (left * square).sqrt(),
        }
    };
    structure.equations().iter().enumerate().map(of).collect()
}
