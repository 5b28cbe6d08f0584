//! Sensitivities by sigma points: the regression of the predictions on the points, exact for a linear model.
//!
//! With pairs of points this is the central difference. Deliberately without noise: the caller whitens.

use nalgebra::DMatrix;

use crate::data::same;
use crate::particles::weighted_transpose;
use crate::{EstimatorError, SigmaSet};

/// (Z - Z alpha 1^T) D I^T / scale: d prediction / d u, m x p, from predictions Z (m x r) at u = centre + `scale` I_i.
///
/// # Errors
/// `Shape` when there is not one column per point; `Spread` when the scale is not positive and finite.
pub fn sigma_point_sensitivities(
    set: &SigmaSet,
    predictions: &DMatrix<f64>,
    scale: f64,
) -> Result<DMatrix<f64>, EstimatorError> {
    same("columns of the predictions", set.n_particle(), predictions.ncols())?;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(EstimatorError::Spread { value: scale });
    }
    let mean = predictions * &set.weights;
    let mut deviation = predictions.clone();
    for mut column in deviation.column_iter_mut() {
        column -= &mean;
    }
    Ok(deviation * weighted_transpose(&set.points, &set.weights) / scale)
}
