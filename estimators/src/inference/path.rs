//! What the uncertainty of a smoothed path adds to that of the coefficients.
//!
//! The information of a noisy recording is what a known path would give, on average, less the covariance of the score over the paths that
//! the recording allows (Louis 1982). Paths are drawn backwards from the smoother (Carter & Kohn 1994). D and M are held at their
//! estimates. Read next: `em.rs`, which found them.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::expected::root;
use super::normal::{Moments, invert};
use super::smoother::Smoothed;
use super::{Fit, InferenceError, Noisy, NoisyPosterior, Posterior, Stream, Structure, Sums, diffusion};

impl Noisy<'_> {
    /// The posterior of [`Noisy::infer`] with intervals that know of the path's uncertainty, from `n_path` drawn paths: ten per
    /// coefficient or more. `draw` gives independent standard normal numbers.
    ///
    /// # Errors
    /// `TooFew` paths; `NotDefinite` where the draws explain more than there is: more of them, or fewer coefficients.
    pub fn with_path_uncertainty(
        &self,
        found: &NoisyPosterior,
        fit: &Fit,
        structure: &Structure,
        n_path: usize,
        draw: &mut dyn FnMut() -> f64,
    ) -> Result<Posterior, InferenceError> {
        let posterior = &found.posterior;
        let n = posterior.active.len();
        if n_path <= n {
            let equation = "the smoothed path".to_owned();
            return Err(InferenceError::TooFew { n_step: n_path as u64, n_unknown: n, equation });
        }
        let inverse = diffusion::inverse(&posterior.diffusion, structure)?;
        let (path, _) = self.smooth(posterior, &found.measured)?;
        let factors: Vec<DMatrix<f64>> = path.iter().map(|at| root(&at.rest)).collect();
        let mut scores = DMatrix::zeros(n, n_path);
        for mut score in scores.column_iter_mut() {
            let sums = self.drawn(&path, &factors, draw)?;
            let normal = Moments::new(&sums, structure).normal(&posterior.active, &inverse, fit.prefactor);
            score.copy_from(&(normal.vector - normal.precision * &posterior.mean));
        }
        let centre = scores.column_mean();
        for mut score in scores.column_iter_mut() {
            score -= &centre;
        }
        let missing = &scores * scores.transpose() / (n_path - 1) as f64;
        let precision = &posterior.precision - missing;
        if precision.clone().cholesky().is_none() {
            return Err(InferenceError::NotDefinite {
                what: "what the drawn paths leave of the information",
            });
        }
        let name = |i: usize| structure.coefficients()[posterior.active[i]].name.clone();
        let covariance = invert(&precision, name)?;
        let mut wider = posterior.clone();
        for (i, p) in posterior.active.iter().enumerate() {
            if let Some(value) = &mut wider.estimates[*p].value {
                value.sd = covariance[(i, i)].sqrt();
            }
        }
        Ok(Posterior { covariance, precision, ..wider })
    }

    /// Sums of one path that the recording allows.
    fn drawn(
        &self,
        path: &[Smoothed],
        factors: &[DMatrix<f64>],
        draw: &mut dyn FnMut() -> f64,
    ) -> Result<Sums, InferenceError> {
        let width = self.basis.n_channel();
        let mut rows = self.rows.to_vec();
        let mut away: Option<DVector<f64>> = None;
        for (k, at) in path.iter().enumerate().rev() {
            let n = at.mean.len();
            let noise = DVector::from_fn(n, |_, _| draw());
            let moved = match &away {
                Some(later) => &at.gain * later + &factors[k] * noise,
                None => root(&at.covariance) * noise,
            };
            let state = &at.mean + &moved;
            rows[k * width..k * width + n].copy_from_slice(state.as_slice());
            away = Some(moved);
        }
        let mut stream = Stream::new(Arc::clone(self.basis), self.step)?;
        stream.extend(self.times, &rows)?;
        stream.take()
    }
}
