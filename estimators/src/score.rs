//! The score test: what a parameter that the model does not have would add to a finished fit, from its sensitivity alone.
//!
//! Rao (1948), in the form of Engle (1984): the part of the new sensitivity that the fitted parameters cannot imitate is
//! compared with the residuals. The gain is linear: only a refit shows whether it is real. Everything is whitened by the noise.
//! Read next: `least_squares.rs`.

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView};

use crate::block_angular::{BlockAngular, Subspace};
use crate::error::EstimatorError;
use crate::spectral;

/// A fit at its optimum, its prior as further rows.
#[derive(Debug, Clone)]
pub struct Optimum {
    /// What the parameters can imitate, and their covariance.
    range: Subspace,
    jacobian: BlockAngular,
    /// Residuals with the prior's, m + p.
    residual: DVector<f64>,
}

/// What one more parameter would add.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Fall of chi-square.
    pub gain: f64,
    /// Its value, in the unit of the sensitivity.
    pub amplitude: f64,
    /// Standard deviation of that value.
    pub sd: f64,
    /// Part of the sensitivity that the fitted parameters cannot imitate, from 0 to 1.
    pub identifiable: f64,
}

impl Optimum {
    /// A fit with whitened residuals `e` (m), Jacobian `j` (m x p), prior precisions (p) and the prior's pull: prior mean
    /// minus estimate (p).
    ///
    /// # Errors
    /// `Shape` when lengths differ; `NotPositiveDefinite` when data and prior together leave a direction free.
    pub fn new(
        residual: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        precision: &DVector<f64>,
        pull: &DVector<f64>,
    ) -> Result<Self, EstimatorError> {
        Self::in_blocks(residual, &BlockAngular::from(jacobian.clone()), precision, pull)
    }

    /// As [`Optimum::new`], for rows that answer to some of the parameters only. The Jacobian is shared with it.
    ///
    /// # Errors
    /// As [`Optimum::new`].
    pub fn in_blocks(
        residual: &DVector<f64>,
        jacobian: &BlockAngular,
        precision: &DVector<f64>,
        pull: &DVector<f64>,
    ) -> Result<Self, EstimatorError> {
        let (m, p) = (jacobian.nrows(), jacobian.ncols());
        let shape = |what, expected, got| EstimatorError::Shape { what, expected, got };
        if residual.len() != m {
            return Err(shape("residuals of the fit", m, residual.len()));
        }
        if precision.len() != p || pull.len() != p {
            return Err(shape("prior of the fit", p, precision.len().min(pull.len())));
        }
        let root = precision.map(f64::sqrt);
        let mut all = residual.clone().resize_vertically(m + p, 0.0);
        all.rows_mut(m, p).copy_from(&root.component_mul(pull));
        // From the triangle of the rows: their square would lose the digits of an informed direction beside a wide prior.
        let range = Subspace::new(jacobian, &root)?;
        Ok(Self { range, jacobian: jacobian.clone(), residual: all })
    }

    /// Covariance of the fitted parameters, p x p.
    pub fn covariance(&self) -> &DMatrix<f64> {
        self.range.covariance()
    }

    /// The part of a sensitivity (m) that the fitted parameters cannot imitate, with the prior's rows, m + p.
    pub fn unimitated(&self, sensitivity: &DVector<f64>) -> DVector<f64> {
        let s = sensitivity.clone().resize_vertically(self.residual.len(), 0.0);
        // Projected twice: the second projection removes the rounding errors of the first.
        self.range.outside(&self.range.outside(&s))
    }

    /// How the fitted parameters move when one more parameter moves by one: minus this, p.
    pub fn response(&self, sensitivity: &DVector<f64>) -> DVector<f64> {
        self.range.covariance() * self.jacobian.tr_times(sensitivity)
    }

    /// The residuals with the prior's, m + p.
    pub fn residual(&self) -> &DVector<f64> {
        &self.residual
    }

    /// The score of a sensitivity d prediction / d amplitude (m). No gain when the fitted parameters can imitate all of it.
    pub fn score(&self, sensitivity: &DVector<f64>) -> Score {
        let whole = sensitivity.norm();
        let own = self.unimitated(sensitivity);
        let size = own.norm();
        if !(size > 0.0 && whole > 0.0 && whole.is_finite()) {
            return Score { gain: 0.0, amplitude: 0.0, sd: f64::INFINITY, identifiable: 0.0 };
        }
        let along = own.dot(&self.residual);
        Score {
            gain: (along / size).powi(2),
            amplitude: along / (size * size),
            sd: 1.0 / size,
            identifiable: size / whole,
        }
    }
}

/// So many candidates at most get the root of their correlation from its eigenvectors, whose cost grows with the cube of their
/// number and a large factor; more get it from a Cholesky factor.
const SPECTRAL: usize = 512;
/// Added to the diagonal of a correlation before it is factored: columns that repeat each other leave it singular, and rounding
/// is smaller than this by far.
const RIDGE: f64 = 1e-10;
/// Simulations that are drawn at a time.
const AT_A_TIME: usize = 64;

/// Products of k columns made of length one, k x k; a column of length zero stays so.
///
/// `column` gives one of them, all of the same length. Of at most [`SPECTRAL`] columns so many are held at a time, and each is
/// asked for once with every such block; of more, whose products are costlier, all are held.
///
/// # Errors
/// Those of `column`.
pub fn score_correlation<E>(
    k: usize,
    at_a_time: usize,
    mut column: impl FnMut(usize) -> Result<DVector<f64>, E>,
) -> Result<DMatrix<f64>, E> {
    let mut unit = |i: usize| {
        let mut column = column(i)?;
        let norm = column.norm();
        column.scale_mut(if norm > 0.0 { 1.0 / norm } else { 0.0 });
        Ok(column)
    };
    if k > SPECTRAL {
        let all: Vec<DVector<f64>> = (0..k).map(&mut unit).collect::<Result<_, E>>()?;
        let all = DMatrix::from_columns(&all);
        return Ok(all.transpose() * &all);
    }
    let mut products = DMatrix::zeros(k, k);
    let mut block: Vec<DVector<f64>> = Vec::new();
    for first in (0..k).step_by(at_a_time.max(1)) {
        block.clear();
        for j in first..k {
            let right = unit(j)?;
            if j - first < at_a_time.max(1) {
                block.push(right.clone());
            }
            for (i, left) in block.iter().enumerate() {
                products[(first + i, j)] = left.dot(&right);
                products[(j, first + i)] = products[(first + i, j)];
            }
        }
    }
    Ok(products)
}

/// Largest gain of any of k parameters where nothing is missing, for each simulation: the distribution that a search over all
/// of them must exceed.
///
/// `correlation` is that of the unimitated sensitivities, as [`score_correlation`] gives it; `signs` says which sign of each
/// amplitude counts (0 both). `draw` gives independent standard normal numbers. The scores are jointly Gaussian with the
/// correlation of the columns, so k numbers make a simulation, whatever the number of data. Infinite throughout, so that
/// nothing exceeds it, for sensitivities that are not finite.
pub fn null_maxima(
    correlation: DMatrix<f64>,
    signs: &[f64],
    n_simulation: usize,
    draw: &mut dyn FnMut() -> f64,
) -> Vec<f64> {
    let Some(root) = root(correlation) else { return vec![f64::INFINITY; n_simulation] };
    let mut maxima = Vec::with_capacity(n_simulation);
    while maxima.len() < n_simulation {
        let n = AT_A_TIME.min(n_simulation - maxima.len());
        let draws = DMatrix::from_fn(root.ncols(), n, |_, _| draw());
        maxima.extend(products(&root, &draws).column_iter().map(|scores| largest(&scores, signs)));
    }
    maxima
}

/// A matrix whose product with its transpose is the correlation; `None` where that is not finite.
fn root(mut correlation: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let k = correlation.ncols();
    if k > SPECTRAL {
        for i in 0..k {
            correlation[(i, i)] += RIDGE;
        }
        return correlation.cholesky().map(Cholesky::unpack);
    }
    let eigen = spectral::eigen(correlation, "correlation of the scores").ok()?;
    Some(&eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt())))
}

/// The root times each of the draws; a few at a time are multiplied one by one.
fn products(root: &DMatrix<f64>, draws: &DMatrix<f64>) -> DMatrix<f64> {
    if root.ncols() > SPECTRAL {
        return root * draws;
    }
    let mut scores = DMatrix::zeros(root.nrows(), draws.ncols());
    for (mut of_one, draw) in scores.column_iter_mut().zip(draws.column_iter()) {
        root.mul_to(&draw, &mut of_one);
    }
    scores
}

/// The largest square among the scores of an allowed sign.
fn largest(scores: &DVectorView<'_, f64>, signs: &[f64]) -> f64 {
    let counts = |(score, sign): (&f64, &f64)| if score * sign >= 0.0 { score * score } else { 0.0 };
    scores.iter().zip(signs).map(counts).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
