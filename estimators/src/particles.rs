//! The particles, and the geometry of points that were pulled towards the mean or dropped.
//!
//! A particle that cannot be run at its sigma point is pulled to a fraction of its distance, or dropped; the others are
//! not moved. The effective points I' and weights no longer have zero mean and unit covariance, so the linear relation
//! between parameters and predictions is found by weighted regression, which is the usual formula when nothing was
//! pulled. Deliberately no run and no data here. Read next: `roukf.rs`.

use nalgebra::{DMatrix, DVector};

use crate::{SigmaSet, spectral};

/// Directions with a smaller share of the unit covariance than this count as lost.
pub(crate) const SPANNED: f64 = 1e-8;

/// Particles of p transformed parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Particles {
    /// Transformed parameters, p x r; a particle is a column.
    pub theta: DMatrix<f64>,
    /// Length r; 1 = at its sigma point, s < 1 = pulled to distance s from the mean, 0 = dropped.
    pub pull: Vec<f64>,
}

impl Particles {
    /// Particles at their sigma points.
    pub(crate) fn whole(theta: DMatrix<f64>) -> Self {
        let pull = vec![1.0; theta.ncols()];
        Self { theta, pull }
    }
}

/// Effective sigma points and the regression on them.
pub(crate) struct Geometry {
    /// Nothing was pulled or dropped.
    pub(crate) whole: bool,
    /// More particles than a linear relation needs.
    redundant: bool,
    /// Effective points I', p x r.
    pub(crate) points: DMatrix<f64>,
    /// Effective weights, length r, sum one.
    pub(crate) weights: DVector<f64>,
    /// q: values times q is the regression's value at the mean, length r, sum one.
    pub(crate) mean: DVector<f64>,
    /// K = D (I' - c)^T M^{-1}: values times K is the regression's slope, r x p.
    pub(crate) slope: DMatrix<f64>,
    /// Share of the unit covariance that is left, trace(M) / p, at most one.
    pub(crate) information: f64,
    /// Direction with the least spread, length p, and its variance.
    pub(crate) weakest: (DVector<f64>, f64),
}

impl Geometry {
    pub(crate) fn new(set: &SigmaSet, pull: &[f64]) -> Self {
        let (p, r) = (set.n_param(), set.n_particle());
        let redundant = r > p + 1;
        if pull.iter().all(|s| *s >= 1.0) {
            return Self {
                whole: true,
                redundant,
                points: set.points.clone(),
                weights: set.weights.clone(),
                mean: set.weights.clone(),
                slope: weighted_transpose(&set.points, &set.weights),
                information: 1.0,
                weakest: (DVector::zeros(p), 1.0),
            };
        }
        let kept = DVector::from_fn(r, |i, _| if pull[i] > 0.0 { set.weights[i] } else { 0.0 });
        let weights = &kept / kept.sum().max(f64::MIN_POSITIVE);
        let points = DMatrix::from_fn(p, r, |i, j| set.points[(i, j)] * pull[j]);
        let c = &points * &weights;
        let centred = DMatrix::from_fn(p, r, |i, j| points[(i, j)] - c[i]);
        let dual = weighted_transpose(&centred, &weights);
        let m = &centred * &dual;
        let information = (m.trace() / p as f64).min(1.0);
        let (inverse, weakest) = inverted(m);
        let slope = dual * inverse;
        let mean = &weights - &slope * &c;
        Self { whole: false, redundant, points, weights, mean, slope, information, weakest }
    }

    /// Particles that count.
    pub(crate) fn active(&self) -> Vec<bool> {
        self.weights.iter().map(|w| *w > 0.0).collect()
    }

    /// (1 - K I') D^{1/2}, r x r: deviations times this is the weighted residual of the regression, `None` when the
    /// regression goes through every point.
    pub(crate) fn even_part(&self) -> Option<DMatrix<f64>> {
        if !self.redundant {
            return None;
        }
        let r = self.weights.len();
        let mut part = DMatrix::identity(r, r) - &self.slope * &self.points;
        for (mut column, w) in part.column_iter_mut().zip(&self.weights) {
            column *= w.sqrt();
        }
        Some(part)
    }

    /// A factor F with (deviations) F F^T (deviations)^T = HL HL^T + R D R^T, for pulled or dropped points.
    pub(crate) fn spread_factor(&self) -> DMatrix<f64> {
        let mut factor = self.slope.clone();
        if let Some(even) = self.even_part() {
            let p = factor.ncols();
            factor = factor.resize_horizontally(p + even.ncols(), 0.0);
            factor.columns_mut(p, even.ncols()).copy_from(&even);
        }
        factor
    }
}

/// The inverse over the directions that are spanned, and the direction with the least spread with its variance. A moment that
/// cannot be decomposed counts as spanning no direction.
fn inverted(moment: DMatrix<f64>) -> (DMatrix<f64>, (DVector<f64>, f64)) {
    let p = moment.nrows();
    let Ok(eigen) = spectral::eigen(moment, "second moment of the sigma points") else {
        return (DMatrix::zeros(p, p), (DVector::zeros(p), 0.0));
    };
    let weak = eigen.eigenvalues.imin();
    let weakest = (eigen.eigenvectors.column(weak).clone_owned(), eigen.eigenvalues[weak]);
    let inverse = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| if v > SPANNED { 1.0 / v } else { 0.0 }));
    (&eigen.eigenvectors * inverse * eigen.eigenvectors.transpose(), weakest)
}

/// D I^T, r x p.
pub(crate) fn weighted_transpose(points: &DMatrix<f64>, weights: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(points.ncols(), points.nrows(), |j, i| weights[j] * points[(i, j)])
}
