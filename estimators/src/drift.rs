//! Drift of the parameters between two analyses, as an r x r matrix on the particles.
//!
//! The covariance of the parameters becomes F P F + Q while the sensitivity dx/dtheta of every state stays what it was:
//! L' = L B with B = L_theta^{-1} M and M M^T = F P F + Q. So drift is one more right factor of the transform, and the
//! states need nothing else. Deliberately no model of the drift beyond forgetting and a random walk.
//! Read next: `roukf.rs`.

use nalgebra::{DMatrix, DVector};

use crate::particles::weighted_transpose;
use crate::{EstimatorError, SigmaSet};

/// How one parameter moves from one analysis to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drift {
    /// It is constant.
    None,
    /// Its sd grows by 1/sqrt(lambda) after each analysis, 0 < lambda <= 1: a memory of 1/(1-lambda) analyses. Nothing
    /// is forgotten at an analysis without data, so the spread does not grow without bound over a gap.
    Forgetting(f64),
    /// Random walk: the sd that each analysis adds, in transformed units, with or without data.
    Walk(f64),
}

/// Checks the number of drifts, p, and the range of each.
pub(crate) fn check(drift: &[Drift], p: usize) -> Result<(), EstimatorError> {
    crate::data::same("drifts", p, drift.len())?;
    let wrong = drift.iter().enumerate().find_map(|(parameter, d)| match *d {
        Drift::Forgetting(value) if !(value > 0.0 && value <= 1.0) => Some((parameter, value)),
        Drift::Walk(value) if !(value >= 0.0 && value.is_finite()) => Some((parameter, value)),
        _ => None,
    });
    wrong.map_or(Ok(()), |(parameter, value)| Err(EstimatorError::DriftOutOfRange { parameter, value }))
}

/// The drift after an analysis: r x r, `None` when nothing moves. `theta` are the particles after the analysis, p x r.
pub(crate) fn transform(
    drift: &[Drift],
    set: &SigmaSet,
    theta: &DMatrix<f64>,
    has_data: bool,
) -> Result<Option<DMatrix<f64>>, EstimatorError> {
    let p = set.n_param();
    let mut inflation = DVector::from_element(p, 1.0);
    let mut added = DVector::zeros(p);
    for (j, d) in drift.iter().enumerate() {
        match *d {
            Drift::Forgetting(lambda) if has_data => inflation[j] = 1.0 / lambda.sqrt(),
            Drift::Walk(sd) => added[j] = sd * sd,
            Drift::None | Drift::Forgetting(_) => {}
        }
    }
    let walks = added.iter().any(|q| *q > 0.0);
    if !walks && inflation.iter().all(|f| *f <= 1.0) {
        return Ok(None);
    }
    let dual = weighted_transpose(&set.points, &set.weights);
    let l = theta * &dual;
    let mut m = DMatrix::from_diagonal(&inflation) * &l;
    if walks {
        let grown = &m * m.transpose() + DMatrix::from_diagonal(&added);
        m = grown.cholesky().ok_or_else(|| no_spread(&l))?.unpack();
    }
    let b =
        l.clone().lu().solve(&m).filter(|b| b.iter().all(|v| v.is_finite())).ok_or_else(|| no_spread(&l))?;
    let mut t = dual * b * &set.points;
    for mut column in t.column_iter_mut() {
        column += &set.weights;
    }
    Ok(Some(t))
}

fn no_spread(l: &DMatrix<f64>) -> EstimatorError {
    let size = DVector::from_iterator(l.nrows(), l.row_iter().map(|row| row.norm()));
    EstimatorError::NoSpread { parameter: size.imin() }
}
