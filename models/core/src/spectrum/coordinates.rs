//! Coordinates in which the error of a structure is well scaled and its modes stand apart.
//!
//! In the displacements and velocities of a structure A has entries that differ by ten orders, and eigenvalues close to zero are
//! lost to rounding. In the energy coordinates y = chol(K)ᵀ d and u = chol(M)ᵀ c the undamped part of A is skew-symmetric, its
//! eigenvectors are orthogonal, and every pole has the accuracy of the largest. There dy/dt = B u, and the singular vectors of
//! B, an orthogonal change of y and u, are the modes of the structure without damping. Other states keep their own units; the
//! balancing of [`super::pole`] scales them. Next file to read: [`super::pole`].

use nalgebra::{Cholesky, DMatrix};

use crate::{Blocks, Model};

/// S A S⁻¹ for the energy coordinates S x of the model's blocks; A itself for a model without blocks, or where a mass or a
/// stiffness is not positive definite.
pub fn natural(model: &dyn Model, theta: &[f64], a: &DMatrix<f64>) -> DMatrix<f64> {
    model
        .blocks(theta)
        .and_then(|blocks| Energy::new(&blocks))
        .map_or_else(|| a.clone(), |energy| energy.of(a))
}

/// The energy coordinates of a fluid–structure system.
pub struct Energy {
    /// First state, S and S⁻¹ of the displacements, then of the velocity unknowns.
    changes: [(usize, DMatrix<f64>, DMatrix<f64>); 2],
}

impl Energy {
    /// Factors mass and stiffness; `None` where one of them is not positive definite.
    pub fn new(blocks: &Blocks) -> Option<Self> {
        let stiffness = Cholesky::new(blocks.stiffness.clone())?.l().transpose();
        let mass = Cholesky::new(blocks.mass.clone())?.l().transpose();
        let (n, n_velocity) = (stiffness.nrows(), mass.nrows());
        let trace = blocks.trace.clone().unwrap_or_else(|| DMatrix::identity(n, n_velocity));
        let rate = &stiffness * trace * inverse(&mass, &DMatrix::identity(n_velocity, n_velocity))?;
        let modes = rate.try_svd(true, true, f64::EPSILON, 100 * n.max(30));
        let modes = modes.and_then(|svd| svd.u.zip(svd.v_t));
        let (left, right) = modes.unwrap_or_else(|| (DMatrix::identity(n, n), DMatrix::identity(n, n)));
        // Velocity unknowns beyond those of the wall have no mode of their own: they stay as they are.
        let right =
            if right.is_square() { right.transpose() } else { DMatrix::identity(n_velocity, n_velocity) };
        let change =
            |factor: DMatrix<f64>, turn: &DMatrix<f64>| Some((turn.tr_mul(&factor), inverse(&factor, turn)?));
        let ((y, d), (u, c)) = (change(stiffness, &left)?, change(mass, &right)?);
        Some(Self { changes: [(blocks.displacement, y, d), (blocks.velocity, u, c)] })
    }

    /// S A S⁻¹.
    pub fn of(&self, a: &DMatrix<f64>) -> DMatrix<f64> {
        let mut b = a.clone();
        for (first, change, back) in &self.changes {
            let n = change.nrows();
            let rows = change * b.rows(*first, n);
            b.rows_mut(*first, n).copy_from(&rows);
            let columns = b.columns(*first, n) * back;
            b.columns_mut(*first, n).copy_from(&columns);
        }
        b
    }
}

/// R⁻¹ Q for an upper triangular R.
fn inverse(upper: &DMatrix<f64>, turn: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    upper.solve_upper_triangular(turn)
}
