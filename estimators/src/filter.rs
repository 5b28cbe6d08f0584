//! What a filter is to the loop that runs it: pure steps on particles, from one observation to the next.
//!
//! The loop samples particles, runs the model on each up to the next observation, hands in their predictions and gets new
//! particles and the transform T to apply to the states. A filter never sees a state: an uncertain initial value is one more
//! parameter, whose direction stays in the particles. Read next: `roukf.rs`.

use std::fmt::Debug;

use nalgebra::{DMatrix, DVector};

use crate::{Analysis, Data, Drift, EstimatorError, Gaussian, Particles};

/// A filter of p parameters with r particles.
pub trait Filter: Debug {
    /// Number of particles r.
    fn n_particle(&self) -> usize;

    /// Weights of the particles in a mean, length r, sum one.
    fn weights(&self) -> &DVector<f64>;

    /// Particles that represent a prior.
    ///
    /// # Panics
    /// When the prior has not p parameters.
    fn init(&self, prior: &Gaussian) -> Particles;

    /// Mean and covariance of the parameters.
    ///
    /// # Panics
    /// When there are not r particles.
    fn gaussian(&self, p: &Particles) -> Gaussian;

    /// One analysis. `predictions` is m x r, rows as in `data`; the column of a dropped particle is ignored, and so is
    /// every row that is missing. Afterwards no particle is pulled or dropped any more.
    ///
    /// # Errors
    /// Wrong lengths, non-finite predictions or data, noise that is not positive, particles that do not span the
    /// parameters.
    fn analysis(
        &self,
        p: &Particles,
        predictions: &DMatrix<f64>,
        data: &Data<'_>,
    ) -> Result<(Particles, Analysis), EstimatorError>;

    /// The drift of the parameters from one analysis to the next, as the r x r matrix M of X <- X M; `None` when nothing moves.
    /// `p` are the particles after an analysis, `has_data` says whether it had any.
    ///
    /// # Errors
    /// `Shape` and `DriftOutOfRange` for a bad drift, `NoSpread` for particles that have no spread to drift from.
    fn drift(
        &self,
        p: &Particles,
        drift: &[Drift],
        has_data: bool,
    ) -> Result<Option<DMatrix<f64>>, EstimatorError>;

    /// The directions L of m rows of values of the particles (m x r), m x p: with the parameters as rows L L^T is their covariance.
    fn directions(&self, p: &Particles, values: &DMatrix<f64>) -> DMatrix<f64>;

    /// A transform X <- X T of these particles in their directions: the mean goes to x + L w, the directions to L C; (w, C).
    fn reduced(&self, p: &Particles, t: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>);

    /// Pulls particle `i` to the distance `s` (0 < s <= 1) of its place from the mean: the new particles, and the r x r
    /// matrix that does the same to the states, X <- X M. The other particles do not move.
    ///
    /// # Panics
    /// When there is no particle `i` or `s` lies outside (0, 1].
    fn pull(&self, p: &Particles, i: usize, s: f64) -> (Particles, DMatrix<f64>);

    /// Drops particle `i`, which could not be run anywhere: the others keep their places, its weight is shared out.
    ///
    /// # Errors
    /// `NotSpanned` when the others no longer span the parameters.
    ///
    /// # Panics
    /// When there is no particle `i`.
    fn drop(&self, p: &Particles, i: usize) -> Result<Particles, EstimatorError>;

    /// Whether its particles carry more spread than an affine map can, so that [`Filter::resample`] has something to do.
    fn resamples(&self) -> bool {
        false
    }

    /// Draws the particles again before an analysis. `gram` (r x r) holds the products sqrt(a_i a_j) <x_i - x, x_j - x> of
    /// deviations from the weighted mean x, in a norm that makes state and parameters commensurable. After X <- X R the
    /// predictions must be evaluated again.
    ///
    /// # Errors
    /// `Shape`, `NotFinite`, `NotDecomposed` for a bad Gram matrix.
    fn resample(&self, p: &Particles, gram: &DMatrix<f64>) -> Result<Resampled, EstimatorError> {
        Ok(Resampled::unchanged(p, gram.nrows()))
    }
}

/// Particles drawn again by [`Filter::resample`].
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// The new particles.
    pub particles: Particles,
    /// The r x r matrix R of X <- X R.
    pub transform: DMatrix<f64>,
    /// Share of the whole spread that lay outside the directions that were kept, in [0, 1]: 0 when p directions hold
    /// everything, or when nothing was drawn again.
    pub dropped: f64,
}

impl Resampled {
    /// The r particles as they were.
    pub(crate) fn unchanged(p: &Particles, r: usize) -> Self {
        Self { particles: p.clone(), transform: DMatrix::identity(r, r), dropped: 0.0 }
    }
}
