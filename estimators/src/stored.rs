//! Step 4 of the analysis from the whitened columns themselves: no square of S is ever formed.
//!
//! Used for few observations and for very informative ones; deliberately not the fast path for many rows.
//! Read next: `analysis.rs`.

use nalgebra::{DMatrix, DVector};

use crate::EstimatorError;
use crate::information::Information;
use crate::particles::Geometry;
use crate::spectral;

impl Information {
    /// From the whitened columns, n_used x (r+1): QR of S, then the SVD of its triangle. `NotFinite` when the products
    /// overflow, `NotDecomposed` when the SVD does not end.
    pub(crate) fn from_columns(columns: &DMatrix<f64>, geometry: &Geometry) -> Result<Self, EstimatorError> {
        let (m, r) = (columns.nrows(), geometry.slope.nrows());
        let p = geometry.slope.ncols();
        let deviations = columns.columns(0, r);
        let mut s = deviations * &geometry.slope;
        let mut d = columns.column(r).clone_owned();
        let mut log_det = 0.0;
        if let Some(even) = geometry.even_part() {
            log_det += absorb(&(deviations * even), &mut s, &mut d)?;
        }
        if m < p {
            s = s.resize_vertically(p, 0.0);
            d = d.resize_vertically(p, 0.0);
        }
        let qr = s.qr();
        qr.q_tr_mul(&mut d);
        // The singular vectors of the transpose are the right ones of S.
        let (vectors, singular, left) = spectral::svd(&qr.unpack_r().transpose(), SENSITIVITY)?;
        let values = singular.map(|s| 1.0 + s * s);
        let along = left * d.rows(0, p);
        let scaled = along.component_mul(&singular).component_div(&values);
        let outside = d.rows(p, d.len() - p).norm_squared();
        let nis = outside + along.component_mul(&along).component_div(&values).sum();
        log_det += singular.iter().map(|s| (s * s).ln_1p()).sum::<f64>();
        let step = &vectors * scaled;
        Ok(Self { vectors, values, step, nis, log_det })
    }
}

/// What is decomposed here.
const SENSITIVITY: &str = "whitened sensitivity";

/// Whitens S and d by the extra noise 1 + Y Y^T, returns its log determinant.
fn absorb(y: &DMatrix<f64>, s: &mut DMatrix<f64>, d: &mut DVector<f64>) -> Result<f64, EstimatorError> {
    let (left, singular, _) = spectral::svd(y, SENSITIVITY)?;
    let shrink = DMatrix::from_diagonal(&singular.map(|v| 1.0 - 1.0 / v.hypot(1.0)));
    *s -= &left * (&shrink * left.tr_mul(s));
    *d -= &left * (&shrink * left.tr_mul(d));
    Ok(singular.iter().map(|v| (v * v).ln_1p()).sum())
}
