//! One analysis: predictions and data in, the r x r transform and every diagnostic out.
//!
//! The steps are those of Moireau & Chapelle (2011), algorithm 3, with the transform written out: X+ = X- T. States are not an
//! argument. Read next: `roukf.rs`, which applies it.

use nalgebra::{DMatrix, DVector};

use crate::information::Information;
use crate::particles::Geometry;
use crate::whiten::{Spread, Sweep, Whitened};
use crate::{Data, EstimatorError, Root};

/// The result of one analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// Transform T, r x r: X+ = X- T for states and parameters alike. Every column sums to one; the row
    /// of a dropped particle is zero, so its column of X- must be finite but does not matter.
    pub transform: DMatrix<f64>,
    /// Innovation, observed minus predicted at the mean, length m, in the unit of each row; NaN = missing.
    pub innovation: DVector<f64>,
    /// Standard deviation of the innovation, sqrt of the diagonal of HL HL^T + W_eff, length m; NaN = missing.
    pub innovation_sd: DVector<f64>,
    /// Rows that were not missing.
    pub n_used: usize,
    /// Normalised innovation squared: about `n_used` when the model explains the data at this noise.
    pub nis: f64,
    /// Log-likelihood of the innovation, natural logarithm.
    pub log_likelihood: f64,
    /// Share of the points' unit covariance lost by pulled or dropped particles, 1 - trace(M)/p; 0 without any.
    pub information_lost: f64,
}

/// Steps 2 to 5. `predictions` is m x r.
pub(crate) fn analyse(
    geometry: &Geometry,
    unit_points: &DMatrix<f64>,
    root: Root,
    predictions: &DMatrix<f64>,
    data: &Data<'_>,
) -> Result<Analysis, EstimatorError> {
    let m = data.values.len();
    let rows = data.observed()?;
    let active = geometry.active();
    let mut innovation = DVector::from_element(m, f64::NAN);
    let mut innovation_sd = innovation.clone();
    let mut information = Information::none(unit_points.nrows());
    let mut log_det_noise = 0.0;
    if !rows.is_empty() {
        let (whitened, found) = inform(geometry, &active, &rows, predictions, data)?;
        for (k, &row) in rows.iter().enumerate() {
            innovation[row] = whitened.innovation[k];
            innovation_sd[row] = whitened.innovation_sd[k];
        }
        log_det_noise = whitened.log_det_noise;
        information = found;
    }
    let unchanged = rows.is_empty() && geometry.whole && geometry.even_part().is_none();
    let transform = if unchanged {
        DMatrix::identity(active.len(), active.len())
    } else {
        transform(geometry, unit_points, root, &information)
    };
    if !transform.iter().all(|v| v.is_finite()) {
        return Err(EstimatorError::NotFinite { what: "the transform of the analysis" });
    }
    let constant = rows.len() as f64 * (2.0 * std::f64::consts::PI).ln();
    Ok(Analysis {
        transform,
        innovation,
        innovation_sd,
        n_used: rows.len(),
        nis: information.nis,
        log_likelihood: -0.5 * (constant + log_det_noise + information.log_det + information.nis),
        information_lost: (1.0 - geometry.information).max(0.0),
    })
}

/// Steps 2 to 4. Few rows, or very informative ones, are factored themselves; otherwise their Gram matrix is.
fn inform(
    geometry: &Geometry,
    active: &[bool],
    rows: &[usize],
    predictions: &DMatrix<f64>,
    data: &Data<'_>,
) -> Result<(Whitened, Information), EstimatorError> {
    let factor = (!geometry.whole).then(|| geometry.spread_factor());
    let spread = factor.as_ref().map_or(Spread::Weighted(geometry.weights.as_slice()), Spread::Factor);
    let sweep = Sweep { predictions, reference: &geometry.mean, active, data, rows, spread };
    let few = rows.len() <= 4 * active.len();
    let whitened = sweep.run(few)?;
    if !few && let Some(information) = Information::from_products(&whitened.products, geometry) {
        return Ok((whitened, information));
    }
    let whitened = if whitened.columns.is_some() { whitened } else { sweep.run(true)? };
    let columns = whitened.columns.as_ref().ok_or(EstimatorError::NotFinite { what: "the whitened rows" })?;
    let information = Information::from_columns(columns, geometry)?;
    Ok((whitened, information))
}

/// Step 5: T = q 1^T + K (w 1^T + C I), which is (alpha + D I^T w) 1^T + D I^T C I when nothing was pulled.
fn transform(
    geometry: &Geometry,
    unit_points: &DMatrix<f64>,
    root: Root,
    information: &Information,
) -> DMatrix<f64> {
    let c = match root {
        Root::Symmetric => information.symmetric_root(),
        Root::Cholesky => information.cholesky_root(),
    };
    let mut new_points = c * unit_points;
    for mut column in new_points.column_iter_mut() {
        column += &information.step;
    }
    let mut t = &geometry.slope * new_points;
    for mut column in t.column_iter_mut() {
        column += &geometry.mean;
    }
    t
}
