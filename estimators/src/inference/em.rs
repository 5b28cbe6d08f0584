//! Drift, noise and measurement noise of a recording, by expectation and maximisation (Dempster, Laird & Rubin 1977; Shumway &
//! Stoffer 1982): smooth the states under the present values, fit as if they were known with that uncertainty, repeat.
//!
//! The noise settles slowly where the measurement's is larger, so its steps are lengthened while the likelihood grows (Salakhutdinov &
//! Roweis 2003). For measurement noise that lagged residuals alone do not mend (`noise_check.rs`). The intervals are those of a known path; `path.rs`
//! adds what the path's uncertainty makes of them. Read next: `smoother.rs`, `expected.rs`.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::expected::expected_sums;
use super::smoother::{Smoothed, System};
use super::{Basis, Diffusion, Fit, InferenceError, Posterior, Stream, Structure, Sums, noise_checks};
use crate::spectral;

/// By how much a step of the noise is lengthened from round to round while the likelihood grows.
const STRETCH: f64 = 1.5;

/// Share of a variance of the residuals that smoothing begins with as noise at least.
const LEAST_LEFT: f64 = 0.01;

/// What is known of the measurement noise.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub enum Measured {
    /// Its covariance M, L x L.
    Known(#[serde(with = "super::text::matrix")] DMatrix<f64>),
    /// Nothing: independent noise of every state is estimated.
    Unknown,
}

/// How far to iterate.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Rounds at most.
    pub most: usize,
    /// Growth of the log-likelihood, in nats, below which it has converged.
    pub tolerance: f64,
}

/// The posterior of a recording with measurement noise.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct NoisyPosterior {
    /// Coefficients and D, given the smoothed path.
    pub posterior: Posterior,
    /// M, L x L.
    #[serde(with = "super::text::matrix")]
    pub measured: DMatrix<f64>,
    /// Log-likelihood of the recording at the start of every round.
    pub log_likelihood: Vec<f64>,
    /// Whether it converged.
    pub converged: bool,
}

/// A uniform recording with measurement noise, held in memory.
#[derive(Debug, Clone)]
pub struct Noisy<'a> {
    /// The functions.
    pub basis: &'a Arc<Basis>,
    /// Sampling step h.
    pub step: f64,
    /// Times, length n.
    pub times: &'a [f64],
    /// Samples of n_channel values, row after row.
    pub rows: &'a [f64],
}

impl Noisy<'_> {
    /// Coefficients, D and M where it is not known.
    ///
    /// # Errors
    /// As for [`Stream::push`] and [`Fit::posterior`]; `NotDefinite` for a given M; `NotPositive` where M is to be found and the
    /// residuals show none; `Overflow` when the smoother loses the recording.
    pub fn infer(
        &self,
        fit: &Fit,
        structure: &Structure,
        measured: &Measured,
        iteration: Iteration,
    ) -> Result<NoisyPosterior, InferenceError> {
        self.infer_watched(fit, structure, measured, iteration, &mut |_| {})
    }

    /// The same; `watch` hears of the log-likelihoods of the rounds so far as each begins.
    ///
    /// # Errors
    /// As for [`Noisy::infer`].
    pub fn infer_watched(
        &self,
        fit: &Fit,
        structure: &Structure,
        measured: &Measured,
        iteration: Iteration,
        watch: &mut dyn FnMut(&[f64]),
    ) -> Result<NoisyPosterior, InferenceError> {
        let mut stream = Stream::new(Arc::clone(self.basis), self.step)?;
        stream.extend(self.times, self.rows)?;
        let raw = stream.take()?;
        let posterior = self.first(fit, &raw, structure, measured)?;
        let noise = match measured {
            Measured::Known(m) => self.given(m)?,
            Measured::Unknown => {
                let checks = noise_checks(&raw, structure, &posterior)?;
                let variance = checks.iter().map(|check| check.measured).collect::<Vec<_>>();
                if let Some(&value) = variance.iter().find(|v| **v <= 0.0) {
                    return Err(InferenceError::NotPositive { what: "the measurement noise", value });
                }
                DMatrix::from_diagonal(&variance.into())
            }
        };
        let plain = Fit { lag_corrected: false, ..fit.clone() };
        let mut log_likelihood: Vec<f64> = Vec::new();
        // What is tried now, and what a round of plain maximisation gave, which is never worse.
        let mut tried = (posterior, noise);
        let mut safe = tried.clone();
        let mut stretch = 1.0;
        let mut converged = false;
        for _ in 0..iteration.most {
            watch(&log_likelihood);
            let (path, log) = self.smooth(&tried.0, &tried.1)?;
            let growth = log_likelihood.last().map_or(f64::INFINITY, |last| log - last);
            if growth < 0.0 && stretch > 1.0 {
                stretch = 1.0;
                tried.clone_from(&safe);
                continue;
            }
            log_likelihood.push(log);
            let sums = expected_sums(self.basis, self.step, self.times, self.rows, &path)?;
            let m = if *measured == Measured::Unknown { self.errors(&path) } else { tried.1.clone() };
            safe = (plain.posterior(&sums, structure)?, m);
            converged = growth < iteration.tolerance;
            if converged {
                break;
            }
            let farther = stretched(&tried.0.diffusion, &safe.0.diffusion, stretch);
            let measured = stretched(&tried.1, &safe.1, stretch);
            if let (Some(d), Some(m)) = (farther, measured) {
                let at = Fit { diffusion: Diffusion::Known(d), ..plain.clone() };
                tried = (at.posterior(&sums, structure)?, m);
            } else {
                tried.clone_from(&safe);
            }
            stretch *= STRETCH;
        }
        Ok(NoisyPosterior { posterior: safe.0, measured: safe.1, log_likelihood, converged })
    }

    /// A fit of the recording as it was measured, from which smoothing begins: with D from lagged residuals, or from all of them. Where
    /// errors of the measurement are so large that neither holds, D is what a known M leaves of it and of each variance a hundredth at
    /// least; the rounds find the rest.
    fn first(
        &self,
        fit: &Fit,
        raw: &Sums,
        structure: &Structure,
        measured: &Measured,
    ) -> Result<Posterior, InferenceError> {
        let unheld = |error: &InferenceError| {
            matches!(error, InferenceError::DiffusionNotDefinite { .. } | InferenceError::NotSettled { .. })
        };
        let plain = Fit { lag_corrected: false, ..fit.clone() };
        let lagged = Fit { lag_corrected: true, ..fit.clone() }.posterior(raw, structure);
        let refused = match lagged {
            Err(error) if unheld(&error) => match plain.posterior(raw, structure) {
                Err(error) if unheld(&error) => error,
                found => return found,
            },
            found => return found,
        };
        let Measured::Known(m) = measured else { return Err(refused) };
        // Without the Jacobian's term, which D multiplies, coefficients and noise settle whatever D is.
        let rough = Fit { prefactor: false, ..plain.clone() }.posterior(raw, structure)?.diffusion;
        let left = &rough - self.given(m)? * (2.0 / self.step);
        let all = 0..rough.nrows();
        let is_left = left.clone().cholesky().is_some()
            && all.clone().all(|l| left[(l, l)] > LEAST_LEFT * rough[(l, l)]);
        let variances = all.map(|l| left[(l, l)].max(LEAST_LEFT * rough[(l, l)])).collect::<Vec<_>>();
        let noise = if is_left { left } else { DMatrix::from_diagonal(&variances.into()) };
        Fit { diffusion: Diffusion::Known(noise), ..plain }.posterior(raw, structure)
    }

    /// Smoothed states under a posterior and M, with the log-likelihood of the recording.
    pub(crate) fn smooth(
        &self,
        posterior: &Posterior,
        noise: &DMatrix<f64>,
    ) -> Result<(Vec<Smoothed>, f64), InferenceError> {
        let (drift, diffusion) = (&posterior.drift, &posterior.diffusion);
        let system = System { basis: self.basis, drift, diffusion, measured: noise, step: self.step };
        system.smooth(self.times, self.rows)
    }

    fn given(&self, m: &DMatrix<f64>) -> Result<DMatrix<f64>, InferenceError> {
        let n = self.basis.n_state();
        if m.shape() != (n, n) {
            let got = m.nrows();
            return Err(InferenceError::Shape { what: "rows of the measurement noise", expected: n, got });
        }
        let even = (m - m.transpose()).amax() <= 1e-12 * m.amax();
        if !even || m.clone().cholesky().is_none() {
            return Err(InferenceError::NotDefinite { what: "the measurement noise" });
        }
        Ok(m.clone())
    }

    /// The mean square of what was measured less the path, of every state.
    fn errors(&self, path: &[Smoothed]) -> DMatrix<f64> {
        let n = self.basis.n_state();
        let mut squares = vec![0.0; n];
        for (row, at) in self.rows.chunks_exact(self.basis.n_channel()).zip(path) {
            for l in 0..n {
                squares[l] += (row[l] - at.mean[l]).powi(2) + at.covariance[(l, l)];
            }
        }
        DMatrix::from_diagonal(&squares.into()) / path.len() as f64
    }
}

/// A step from one covariance to another, so many times as long, as a product: A^{1/2} (A^{−1/2} B A^{−1/2})^w A^{1/2}.
fn stretched(from: &DMatrix<f64>, to: &DMatrix<f64>, times: f64) -> Option<DMatrix<f64>> {
    let root = from.clone().cholesky()?.unpack();
    let half = root.solve_lower_triangular(to)?;
    let ratio = root.solve_lower_triangular(&half.transpose())?;
    let eigen = spectral::eigen((&ratio + ratio.transpose()) * 0.5, "change of the noise").ok()?;
    let longer = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(f64::MIN_POSITIVE).powf(times)));
    let factor = root * eigen.eigenvectors;
    let stretched = &factor * longer * factor.transpose();
    let even = (&stretched + stretched.transpose()) * 0.5;
    even.iter().all(|v| v.is_finite()).then_some(even)
}
