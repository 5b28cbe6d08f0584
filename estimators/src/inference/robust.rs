//! Coefficients and their intervals under noise whose size varies: by what the residuals of each step say, not by their mean.
//!
//! With s = h Fᵀ D⁻¹ r, the score of a step, and Ξ the precision, the estimate has the covariance Ξ⁻¹ (Σ s sᵀ) Ξ⁻¹ whatever the noise of
//! each step is, as long as that of different ones is independent: the sandwich of Eicker (1963), Huber (1967) and White (1980). At the
//! mid-point a score has the mean ½ h Σ_lk W_lk ∂F_lp/∂x_k, W = h D⁻¹ r rᵀ, where the fit takes off the mean of W, the unit matrix: what W
//! and the slopes vary by together, the drift that noise induces, moves the coefficients of curved functions and is taken off here. The
//! drift is then that of Itô's equation. Both sums are those of a sample of the steps, each as often as it stands for others. What a sample
//! does not know of the second widens the interval, which therefore stops shrinking where the recording is much longer than the sample.
//! Each residual is divided by what its own step leaves of it (MacKinnon & White 1985, HC3). The estimate is not the most accurate one.
//! Read next: `varying.rs`, which says when this is needed.

use nalgebra::{DMatrix, DVector};

use super::pairs::Pair;
use super::residuals::Residuals;
use super::{Basis, Fit, InferenceError, Pairs, Posterior, Structure, diffusion};

/// What a step leaves of its own residual at least.
const LEAST_LEFT: f64 = 0.5;
/// Products of two coefficients that are summed at most; of more coefficients fewer steps are taken.
const MOST_PRODUCTS: usize = 4_000_000_000;

/// A posterior and the sample that it is asked again with.
struct Sample<'a> {
    posterior: &'a Posterior,
    pairs: &'a Pairs,
    structure: &'a Structure,
    step: f64,
    /// D⁻¹.
    inverse: DMatrix<f64>,
    /// One pair in so many is taken.
    every: usize,
    /// Coefficients that enter each equation, by their place among those that have a value, with factor and function.
    entering: Vec<Vec<(usize, f64, usize)>>,
}

/// Means over the steps of a sample.
struct Means {
    /// W, L x L.
    products: DMatrix<f64>,
    /// ∂φ_b/∂x_l, `slopes[b * L + l]`.
    slopes: DVector<f64>,
}

impl Fit {
    /// The posterior of noise of any size in each step, from the one of noise of one size that this fit gave and pairs of steps of the
    /// same recordings.
    ///
    /// # Errors
    /// `Incompatible` pairs; `NothingObserved` without any; `Overflow` where the covariance is not finite, or has no inverse.
    pub fn robust(
        &self,
        posterior: &Posterior,
        pairs: &Pairs,
        (basis, structure): (&Basis, &Structure),
        step: f64,
    ) -> Result<Posterior, InferenceError> {
        if pairs.n_pair() == 0 {
            return Err(InferenceError::NothingObserved);
        }
        let inverse = diffusion::inverse(&posterior.diffusion, structure)?;
        let residuals = || Residuals::new(pairs, basis, &posterior.drift, step);
        let every = every(pairs.n_pair(), posterior.active.len());
        let entering = entering(structure, &posterior.active);
        let sample = Sample { posterior, pairs, structure, step, inverse, every, entering };
        let means = sample.means(residuals()?);
        let [scores, moved] = sample.scores(residuals()?, &means, self.prefactor);
        let prior = self.prior.select(&posterior.active).1;
        let covariance = &posterior.covariance * (scores + prior) * &posterior.covariance;
        let mean = &posterior.mean - &posterior.covariance * moved.column(0);
        posterior.with(structure, mean, (&covariance + covariance.transpose()) * 0.5)
    }
}

/// One of so many pairs in how many is taken for so many coefficients.
fn every(n_pair: usize, n_active: usize) -> usize {
    (2 * n_pair).saturating_mul(n_active.pow(2)).div_ceil(MOST_PRODUCTS).max(1)
}

/// The coefficients that enter each equation.
fn entering(structure: &Structure, active: &[usize]) -> Vec<Vec<(usize, f64, usize)>> {
    let mut entering = vec![Vec::new(); structure.equations().len()];
    for (i, p) in active.iter().enumerate() {
        for place in &structure.coefficients()[*p].places {
            entering[place.equation].push((i, place.factor, place.function));
        }
    }
    entering
}

impl Sample<'_> {
    /// The pairs that are taken, each with the steps of the recordings that each of its two stands for.
    fn pairs(&self) -> impl Iterator<Item = (Pair<'_>, f64)> {
        let taken = || self.pairs.iter().step_by(self.every);
        let all: f64 = taken().map(|pair| 2.0 * pair.weight).sum();
        let times = self.posterior.n_step as f64 / all;
        taken().map(move |pair| (pair, times * pair.weight))
    }

    fn means(&self, mut residuals: Residuals<'_>) -> Means {
        let (l, b) = self.posterior.drift.shape();
        let mut means = Means { products: DMatrix::zeros(l, l), slopes: DVector::zeros(b * l) };
        for (pair, times) in self.pairs() {
            for second in 0..2 {
                let residual = DVector::from_column_slice(residuals.of(&pair, second));
                means.products.ger(times * self.step, &(&self.inverse * &residual), &residual, 1.0);
                let slopes = residuals.slopes(&pair, second);
                means.slopes.iter_mut().zip(slopes).for_each(|(sum, v)| *sum += times * v);
            }
        }
        let n = self.posterior.n_step as f64;
        Means { products: means.products / n, slopes: means.slopes / n }
    }

    /// Σ of the squares of scores over all steps, A x A, each less what it is moved by, whose sum is the first column of the second:
    /// what moves is known as well as the sample says.
    fn scores(&self, mut residuals: Residuals<'_>, means: &Means, moves: bool) -> [DMatrix<f64>; 2] {
        let n = self.posterior.active.len();
        let (mut squares, mut moved) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 1));
        for (pair, times) in self.pairs() {
            for second in 0..2 {
                let residual = DVector::from_column_slice(residuals.of(&pair, second));
                let phi = DVector::from_column_slice(residuals.functions());
                let slopes = residuals.slopes(&pair, second);
                let by = if moves { self.moved(&residual, slopes, means) } else { DVector::zeros(n) };
                let score = self.score(residual, &phi) - &by;
                squares.ger(times, &score, &score, 1.0);
                if by.iter().any(|by| by.abs() > 0.0) {
                    squares.ger(times * (times - 1.0).max(0.0), &by, &by, 1.0);
                    moved.column_mut(0).axpy(times, &by, 1.0);
                }
            }
        }
        [squares, moved]
    }

    /// s of a step, length A.
    fn score(&self, mut residual: DVector<f64>, phi: &DVector<f64>) -> DVector<f64> {
        let Posterior { covariance, diffusion, .. } = self.posterior;
        for (l, (residual, entering)) in residual.iter_mut().zip(&self.entering).enumerate() {
            let mut own = 0.0;
            for (i, a, of) in entering {
                let row: f64 =
                    entering.iter().map(|(j, b, with)| covariance[(*j, *i)] * b * phi[*with]).sum();
                own += row * a * phi[*of];
            }
            *residual /= (1.0 - own * self.step / diffusion[(l, l)]).max(LEAST_LEFT);
        }
        let weighted = &self.inverse * residual * self.step;
        self.by_coefficient(|equation, function| weighted[equation] * phi[function])
    }

    /// What the mean of a step's score is more than under noise of one size, length A.
    fn moved(&self, residual: &DVector<f64>, slopes: &[f64], means: &Means) -> DVector<f64> {
        let n = residual.len();
        let more = &self.inverse * residual * residual.transpose() * self.step - &means.products;
        self.by_coefficient(|equation, function| {
            let slope = |k: usize| slopes[function * n + k] - means.slopes[function * n + k];
            0.5 * self.step * (0..n).map(|k| more[(equation, k)] * slope(k)).sum::<f64>()
        })
    }

    /// Sums over the places of every coefficient that has a value.
    fn by_coefficient(&self, of: impl Fn(usize, usize) -> f64) -> DVector<f64> {
        let active = &self.posterior.active;
        let one = |p: &usize| {
            let places = self.structure.coefficients()[*p].places.iter();
            places.map(|a| a.factor * of(a.equation, a.function)).sum::<f64>()
        };
        DVector::from_iterator(active.len(), active.iter().map(one))
    }
}

impl Posterior {
    /// The same with another mean and covariance of the coefficients.
    fn with(
        &self,
        structure: &Structure,
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
    ) -> Result<Self, InferenceError> {
        let overflow = InferenceError::Overflow { what: "the covariance of the coefficients" };
        if !covariance.iter().chain(&mean).all(|v| v.is_finite()) {
            return Err(overflow);
        }
        let precision = covariance.clone().cholesky().ok_or(overflow)?.inverse();
        let observed = (0..self.estimates.len()).filter(|p| self.estimates[*p].observed);
        let observed: Vec<usize> = observed.collect();
        let estimates = Self::estimates(structure, &self.active, &observed, &mean, &covariance);
        let drift = structure.matrix(&self.active, mean.as_slice());
        Ok(Self { estimates, mean, covariance, precision, drift, ..self.clone() })
    }
}
