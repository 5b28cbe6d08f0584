//! Directions in parameter space as combinations that can be named: the largest coefficient is one.
//!
//! Directions about which the data hold no information have no natural axes of their own; they are turned so that each has a
//! parameter that the others lack, by Gauss-Jordan elimination with complete pivoting. The caller writes them as text.

use nalgebra::{DMatrix, DVector};

use crate::spectral;

/// Share of the prior variance above which directions are as good as untouched, and may be turned among themselves.
const UNTOUCHED: f64 = 0.99;
/// Coefficients below this pass for rounding.
const ROUNDING: f64 = 1e-9;

/// A combination of parameters, each in units of its prior sd, and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// One coefficient per parameter; the largest in size is +1.
    pub coefficients: Vec<f64>,
    /// Expected posterior sd over prior sd of this combination, in (0, 1].
    pub share: f64,
    /// Sd by the data alone, in prior sd of this combination; `None` without information.
    pub standard_error: Option<f64>,
}

/// An eigenvector of a covariance in prior sd.
pub(super) struct Axis {
    /// Unit vector, length p.
    pub(super) vector: DVector<f64>,
    /// Posterior variance, in prior variances.
    pub(super) variance: f64,
    /// Variance by the data alone; `None` without information.
    pub(super) error: Option<f64>,
}

/// The directions of a posterior that keep more than `share` of their prior sd, the least informed first.
///
/// `covariance` is p x p and `prior_sd` has length p, both in transformed units. None for a covariance without eigenvalues.
pub fn weak_directions(covariance: &DMatrix<f64>, prior_sd: &[f64], share: f64) -> Vec<Direction> {
    let p = prior_sd.len();
    let whitened = DMatrix::from_fn(p, p, |i, j| {
        0.5 * (covariance[(i, j)] + covariance[(j, i)]) / (prior_sd[i] * prior_sd[j])
    });
    let Ok(eigen) = spectral::eigen(whitened, "posterior covariance") else { return Vec::new() };
    let mut order: Vec<usize> = (0..p).filter(|k| eigen.eigenvalues[*k] > share * share).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let axis = |k: usize| {
        let variance = eigen.eigenvalues[k].min(1.0);
        let error = (variance < 1.0).then(|| variance / (1.0 - variance));
        Axis { vector: eigen.eigenvectors.column(k).into_owned(), variance, error }
    };
    named(&order.into_iter().map(axis).collect::<Vec<_>>())
}

/// The axes, the least informed first, as directions; those that the data leave untouched turned to be read easily.
pub(super) fn named(axes: &[Axis]) -> Vec<Direction> {
    let n = axes.iter().take_while(|axis| axis.variance > UNTOUCHED).count();
    let (untouched, touched) = axes.split_at(n);
    let mut directions: Vec<Direction> =
        turned(untouched).into_iter().map(|vector| direction(&vector, untouched)).collect();
    directions.sort_by(|a, b| b.share.total_cmp(&a.share));
    directions.extend(touched.iter().map(|axis| direction(&axis.vector, std::slice::from_ref(axis))));
    directions
}

/// A combination within the span of some axes.
fn direction(vector: &DVector<f64>, axes: &[Axis]) -> Direction {
    let unit = vector.normalize();
    let parts: Vec<(f64, &Axis)> = axes.iter().map(|a| (a.vector.dot(&unit).powi(2), a)).collect();
    let error = parts.iter().filter(|(part, _)| *part > ROUNDING).map(|(part, a)| Some(part * a.error?));
    let largest = unit.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(1.0);
    Direction {
        coefficients: unit.iter().map(|c| c / largest).collect(),
        share: parts.iter().map(|(part, a)| part * a.variance).sum::<f64>().sqrt().min(1.0),
        standard_error: error.sum::<Option<f64>>().map(f64::sqrt),
    }
}

/// Another basis of the span of the axes: reduced row echelon form, the largest entry left as the next pivot.
fn turned(axes: &[Axis]) -> Vec<DVector<f64>> {
    let mut rows: Vec<DVector<f64>> = axes.iter().map(|axis| axis.vector.clone()).collect();
    for step in 0..rows.len() {
        let size = |row: usize, column: usize| rows[row][column].abs();
        let places = (step..rows.len()).flat_map(|row| (0..rows[row].len()).map(move |column| (row, column)));
        let Some((row, column)) = places.max_by(|a, b| size(a.0, a.1).total_cmp(&size(b.0, b.1))) else {
            break;
        };
        rows.swap(step, row);
        let pivot = rows[step].clone() / rows[step][column];
        for (k, other) in rows.iter_mut().enumerate() {
            let factor = other[column];
            if k == step {
                other.copy_from(&pivot);
            } else {
                other.axpy(-factor, &pivot, 1.0);
            }
        }
    }
    for row in &mut rows {
        row.apply(|v| {
            if v.abs() < ROUNDING {
                *v = 0.0;
            }
        });
    }
    rows
}
