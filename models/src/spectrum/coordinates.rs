//! Coordinates in which the error of a structure is well scaled.
//!
//! In the displacements and velocities of a structure A has entries that differ by ten orders, and eigenvalues close to zero are
//! lost to rounding. In the energy coordinates y = chol(K)ᵀ d and u = chol(M)ᵀ c the undamped part of A is skew-symmetric, its
//! eigenvectors are orthogonal, and every pole has the accuracy of the largest. Other states keep their own units; the balancing
//! of [`super::pole`] scales them. Next file to read: [`super::pole`].

use nalgebra::{Cholesky, DMatrix};

use crate::{Blocks, Model};

/// S A S⁻¹ for the energy coordinates S x of the model's blocks; A itself for a model without blocks, or where a mass or a
/// stiffness is not positive definite.
pub fn natural(model: &dyn Model, theta: &[f64], a: &DMatrix<f64>) -> DMatrix<f64> {
    model.blocks(theta).and_then(|blocks| Energy::new(&blocks)).map_or_else(|| a.clone(), |energy| energy.of(a))
}

/// The energy coordinates of a fluid–structure system.
pub struct Energy {
    /// First state and transposed Cholesky factor of the displacements, then of the velocity unknowns.
    factors: [(usize, DMatrix<f64>); 2],
}

impl Energy {
    /// Factors mass and stiffness; `None` where one of them is not positive definite.
    pub fn new(blocks: &Blocks) -> Option<Self> {
        let factor = |matrix: &DMatrix<f64>| Some(Cholesky::new(matrix.clone())?.l().transpose());
        Some(Self {
            factors: [
                (blocks.displacement, factor(&blocks.stiffness)?),
                (blocks.velocity, factor(&blocks.mass)?),
            ],
        })
    }

    /// S A S⁻¹.
    pub fn of(&self, a: &DMatrix<f64>) -> DMatrix<f64> {
        let mut b = a.clone();
        for (first, factor) in &self.factors {
            let n = factor.nrows();
            let rows = factor * b.rows(*first, n);
            b.rows_mut(*first, n).copy_from(&rows);
            // B S⁻¹ = (S⁻ᵀ Bᵀ)ᵀ, Sᵀ being lower triangular.
            let mut columns = b.columns(*first, n).transpose();
            let lower = factor.transpose();
            if lower.solve_lower_triangular_mut(&mut columns) {
                b.columns_mut(*first, n).copy_from(&columns.transpose());
            }
        }
        b
    }
}
