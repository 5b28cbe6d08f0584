//! What the data say about the unit parameters: U = 1 + S^T S, the step w, and the terms of the likelihood.
//!
//! S = W^{-1/2} HL are the whitened sensitivities, d the whitened innovation (Moireau & Chapelle 2011, algorithm 3). For
//! more than p + 1 particles the part of the spread that is not linear in the parameters acts as extra noise,
//! W + R D R^T. This file works from the Gram matrix; where that would lose digits, `stored.rs` works from the columns.

use nalgebra::{DMatrix, DVector};

use crate::particles::Geometry;
use crate::spectral;

/// Above this squared size of S the unit matrix in 1 + S^T S is lost in rounding.
const LARGEST: f64 = 1e12;

fn drowns(size: f64) -> bool {
    !size.is_finite() || size > LARGEST
}

/// Result of step 4: U = V (1 + s^2) V^T and what follows from it.
pub(crate) struct Information {
    /// Eigenvectors V, p x p.
    pub(crate) vectors: DMatrix<f64>,
    /// 1 + s^2, length p.
    pub(crate) values: DVector<f64>,
    /// w = U^{-1} S^T d, length p.
    pub(crate) step: DVector<f64>,
    /// d^T d - (S^T d)^T U^{-1} (S^T d).
    pub(crate) nis: f64,
    /// log det U, plus that of the extra noise.
    pub(crate) log_det: f64,
}

impl Information {
    /// No data: U = 1, w = 0.
    pub(crate) fn none(p: usize) -> Self {
        Self {
            vectors: DMatrix::identity(p, p),
            values: DVector::from_element(p, 1.0),
            step: DVector::zeros(p),
            nis: 0.0,
            log_det: 0.0,
        }
    }

    /// From the Gram matrix of the whitened columns, (r+1) x (r+1); `None` when that would lose too many digits.
    pub(crate) fn from_products(products: &DMatrix<f64>, geometry: &Geometry) -> Option<Self> {
        let r = geometry.slope.nrows();
        let (zz, zd) = (products.view((0, 0), (r, r)), products.view((0, r), (r, 1)));
        let zs = zz * &geometry.slope;
        let mut ss = geometry.slope.tr_mul(&zs);
        let mut sd = geometry.slope.tr_mul(&zd);
        let mut dd = products[(r, r)];
        let mut log_det = 0.0;
        if drowns(ss.trace()) {
            return None;
        }
        if let Some(even) = geometry.even_part() {
            let spread = DMatrix::identity(r, r) + even.tr_mul(&(zz * &even));
            if drowns(spread.trace()) {
                return None;
            }
            // Woodbury: W_eff^{-1} = 1 - Y (1 + Y^T Y)^{-1} Y^T in whitened rows.
            let root = spread.cholesky()?.unpack();
            let ys = root.solve_lower_triangular(&even.tr_mul(&zs))?;
            let yd = root.solve_lower_triangular(&even.tr_mul(&zd))?;
            ss -= ys.tr_mul(&ys);
            sd -= ys.tr_mul(&yd);
            dd -= yd.norm_squared();
            log_det += 2.0 * root.diagonal().iter().map(|v| v.ln()).sum::<f64>();
        }
        let p = ss.nrows();
        let unit = DMatrix::identity(p, p) + (&ss + ss.transpose()) * 0.5;
        let eigen = spectral::eigen(unit, "information").ok()?;
        let values = eigen.eigenvalues.map(|v| v.max(1.0));
        let step = &eigen.eigenvectors * eigen.eigenvectors.tr_mul(&sd).component_div(&values);
        let step = DVector::from_column_slice(step.as_slice());
        let nis = (dd - sd.dot(&step)).max(0.0);
        log_det += values.iter().map(|v| v.ln()).sum::<f64>();
        Some(Self { vectors: eigen.eigenvectors, values, step, nis, log_det })
    }

    /// U^{-1/2}, symmetric.
    pub(crate) fn symmetric_root(&self) -> DMatrix<f64> {
        let scale = DMatrix::from_diagonal(&self.values.map(|v| 1.0 / v.sqrt()));
        &self.vectors * scale * self.vectors.transpose()
    }

    /// Lower Cholesky factor of U^{-1}, from a QR factorisation of a root so that no digit is lost when U is large.
    pub(crate) fn cholesky_root(&self) -> DMatrix<f64> {
        let root = DMatrix::from_diagonal(&self.values.map(|v| 1.0 / v.sqrt())) * self.vectors.transpose();
        let mut lower = root.qr().unpack_r().transpose();
        for mut column in lower.column_iter_mut() {
            let pivot = column.iter().copied().find(|v| v.abs() > 0.0).unwrap_or(1.0);
            if pivot < 0.0 {
                column.neg_mut();
            }
        }
        lower
    }
}
