//! The equations for the coefficients at a given noise: what one pass of a fit solves.
//!
//! Ξ = h Σ Fᵀ D⁻¹ F and w = h Σ (Fᵀ D⁻¹ ẋ − v/2) with v_p = Σ_l ∂F_lp/∂x_l (Smelyanskiy, Luchinsky et al., eq. 1.11, with
//! F at the mid-point of the step as v is), from sums alone: Ξ_pq = h Σ s s' (D⁻¹)_ll' Φ_bb' over the places of p and q.
//! Read next: `fit.rs`.

use nalgebra::{DMatrix, DVector};

use super::structure::{Place, Structure};
use super::{InferenceError, Sums};
use crate::spectral;

/// Share of a column that no other column explains, below which rounding decides what is left of it.
const LEAST_PIVOT: f64 = 1e-11;
/// Part of a combination, relative to its strongest, from which a coefficient counts as taking part.
const TAKES_PART: f64 = 0.1;

/// Sums as a structure sees them: what its known terms leave.
pub(crate) struct Moments<'a> {
    pub(crate) structure: &'a Structure,
    phi: DMatrix<f64>,
    /// Σ (ẋ − C₀ φ) φᵀ, L x B.
    free: DMatrix<f64>,
    v: &'a DMatrix<f64>,
    pub(crate) step: f64,
}

/// Ξ and w of the data, for some of the coefficients.
pub(crate) struct Normal {
    pub(crate) precision: DMatrix<f64>,
    pub(crate) vector: DVector<f64>,
}

impl<'a> Moments<'a> {
    pub(crate) fn new(sums: &'a Sums, structure: &'a Structure) -> Self {
        let phi = sums.phi();
        let free = sums.z() - structure.matrix(&[], &[]) * &phi;
        Self { structure, phi, free, v: sums.v(), step: sums.step() }
    }

    fn places(&self, p: usize) -> &[Place] {
        &self.structure.coefficients()[p].places
    }

    /// Σ over places of p and q of the factors times Φ times a weight of the two equations.
    fn between(&self, p: usize, q: usize, weight: impl Fn(usize, usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for a in self.places(p) {
            for b in self.places(q) {
                let weight = weight(a.equation, b.equation);
                sum += a.factor * b.factor * weight * self.phi[(a.function, b.function)];
            }
        }
        sum
    }

    /// What the data say of one coefficient, Ξ_pp.
    pub(crate) fn information(&self, p: usize, inverse: &DMatrix<f64>) -> f64 {
        self.step * self.between(p, p, |l, k| inverse[(l, k)])
    }

    /// The equations for the coefficients at these indices, for an inverse D⁻¹ of the noise.
    pub(crate) fn normal(&self, active: &[usize], inverse: &DMatrix<f64>, prefactor: bool) -> Normal {
        let n = active.len();
        let mut precision = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let value = self.step * self.between(active[i], active[j], |l, k| inverse[(l, k)]);
                precision[(i, j)] = value;
                precision[(j, i)] = value;
            }
        }
        let mut slope = inverse * &self.free;
        if prefactor {
            slope -= self.v * 0.5;
        }
        Normal { precision, vector: self.along(active, &slope) }
    }

    /// h Σ s (…)_lb over the places of each of these coefficients, for a matrix L x B.
    fn along(&self, active: &[usize], slope: &DMatrix<f64>) -> DVector<f64> {
        let of = |p: &usize| {
            let places = self.places(*p).iter();
            self.step * places.map(|a| a.factor * slope[(a.equation, a.function)]).sum::<f64>()
        };
        DVector::from_iterator(active.len(), active.iter().map(of))
    }

    /// h Σ ½ Fᵀ (W D − 1) V of the coefficients at these indices: what V adds to their vector where the weights W are not the inverse of the
    /// noise D, for W D.
    pub(crate) fn beside(&self, active: &[usize], weighted: &DMatrix<f64>) -> DVector<f64> {
        let n = weighted.nrows();
        self.along(active, &((weighted - DMatrix::identity(n, n)) * self.v * 0.5))
    }

    /// Number of these coefficients that enter each equation, length L.
    pub(crate) fn unknowns(&self, active: &[usize]) -> Vec<usize> {
        let enters = |p: usize, l: usize| self.places(p).iter().any(|place| place.equation == l);
        let count = |l| active.iter().filter(|p| enters(**p, l)).count();
        (0..self.structure.equations().len()).map(count).collect()
    }
}

/// (D⁻¹ ⊗ A)⁻¹ = D ⊗ A⁻¹ for a precision of that form, of the functions that all of n equations share: one inverse of B x B instead
/// of one of LB x LB.
pub(crate) fn invert_shared(
    precision: &DMatrix<f64>,
    inverse: &DMatrix<f64>,
    name: impl Fn(usize) -> String,
) -> Result<DMatrix<f64>, InferenceError> {
    let b = precision.nrows() / inverse.nrows();
    let of_functions = precision.view((0, 0), (b, b)) / inverse[(0, 0)];
    let overflow = InferenceError::Overflow { what: "the inverse of the noise" };
    let noise = inverse.clone().cholesky().ok_or(overflow)?.inverse();
    Ok(noise.kronecker(&invert(&of_functions, name)?))
}

/// The inverse of a precision; `name` gives the names of its rows.
///
/// # Errors
/// `Collinear` with the names of the rows that are not told apart, `Overflow`.
pub(crate) fn invert(
    precision: &DMatrix<f64>,
    name: impl Fn(usize) -> String,
) -> Result<DMatrix<f64>, InferenceError> {
    let overflow = InferenceError::Overflow { what: "the information about the coefficients" };
    let scale = precision.diagonal().map(|v| 1.0 / v.sqrt());
    if !precision.iter().chain(&scale).all(|v| v.is_finite()) {
        return Err(overflow);
    }
    let d = DMatrix::from_diagonal(&scale);
    let correlation = &d * precision * &d;
    let root = correlation.clone().cholesky();
    let Some(root) = root.filter(|root| root.l_dirty().diagonal().iter().all(|v| v * v > LEAST_PIVOT)) else {
        let columns = weakest(correlation)?.into_iter().map(name).collect();
        return Err(InferenceError::Collinear { columns });
    };
    Ok(&d * root.inverse() * &d)
}

/// The rows that take part in the weakest direction of a correlation matrix, the strongest first.
fn weakest(correlation: DMatrix<f64>) -> Result<Vec<usize>, InferenceError> {
    let eigen = spectral::eigen(correlation, "correlation of terms")
        .map_err(|_| InferenceError::Overflow { what: "the information about the coefficients" })?;
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin()).map(f64::abs);
    let mut rows: Vec<usize> =
        (0..direction.len()).filter(|i| direction[*i] >= TAKES_PART * direction.amax()).collect();
    rows.sort_by(|i, j| direction[*j].total_cmp(&direction[*i]));
    Ok(rows)
}
