//! Free vibration in normal modes: M d²d/dt² + τ K dd/dt + K d = 0, exact for any step.
//!
//! Next file to read: [`super::elements`], then [`super::propagator`] for systems whose modes are coupled.

use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};
use starlings_models_core::oscillation::free_motion;

/// Normal modes Φ with Φᵀ M Φ = 1 and Φᵀ K Φ = ω².
#[derive(Clone, Debug)]
pub(crate) struct Vibration {
    /// Φ, one mode per column.
    shapes: DMatrix<f64>,
    /// Φᵀ M = Φ⁻¹, from displacements to modal amplitudes.
    amplitudes: DMatrix<f64>,
    /// ω² of each mode.
    squares: Vec<f64>,
    /// τ.
    retardation: f64,
}

impl Vibration {
    /// Modes that are known: an orthonormal symmetric transform.
    pub(crate) fn orthonormal(transform: &DMatrix<f64>, squares: Vec<f64>, retardation: f64) -> Self {
        Self { shapes: transform.clone(), amplitudes: transform.clone(), squares, retardation }
    }

    /// Solves K Φ = M Φ ω² by the Cholesky factor M = G Gᵀ; everything is NaN when M is not positive definite.
    pub(crate) fn of(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>, retardation: f64) -> Self {
        let n = mass.nrows();
        let finite = mass.iter().chain(stiffness.iter()).all(|v| v.is_finite());
        let factor = if finite { mass.clone().cholesky() } else { None };
        let solved = factor.and_then(|factor| {
            let g = factor.l();
            let inverse = g.solve_lower_triangular(&DMatrix::identity(n, n))?;
            let reduced = &inverse * stiffness * inverse.transpose();
            let eigen = SymmetricEigen::new(0.5 * (&reduced + reduced.transpose()));
            let (shapes, amplitudes) =
                (inverse.tr_mul(&eigen.eigenvectors), eigen.eigenvectors.tr_mul(&g.transpose()));
            Some(Self { shapes, amplitudes, squares: eigen.eigenvalues.as_slice().to_vec(), retardation })
        });
        solved.unwrap_or_else(|| {
            let lost = DMatrix::from_element(n, n, f64::NAN);
            Self { shapes: lost.clone(), amplitudes: lost, squares: vec![f64::NAN; n], retardation }
        })
    }

    /// Writes the acceleration −M⁻¹ K (d + τ v).
    pub(crate) fn acceleration(&self, d: &[f64], v: &[f64], out: &mut [f64]) {
        let load = DVector::from_iterator(d.len(), d.iter().zip(v).map(|(d, v)| d + self.retardation * v));
        let mut modal = &self.amplitudes * load;
        modal.iter_mut().zip(&self.squares).for_each(|(amplitude, square)| *amplitude *= -square);
        out.copy_from_slice((&self.shapes * modal).as_slice());
    }

    /// Moves displacements and velocities over a time `h`, each mode as a damped oscillator of its own.
    pub(crate) fn advance(&self, h: f64, d: &mut [f64], v: &mut [f64]) {
        let n = d.len();
        let mut position = &self.amplitudes * DVectorView::from_slice(d, n);
        let mut speed = &self.amplitudes * DVectorView::from_slice(v, n);
        for ((position, speed), square) in position.iter_mut().zip(speed.iter_mut()).zip(&self.squares) {
            let oscillator = [1.0, self.retardation * square, *square];
            [*position, *speed] = free_motion(&oscillator, h, [*position, *speed]);
        }
        d.copy_from_slice((&self.shapes * position).as_slice());
        v.copy_from_slice((&self.shapes * speed).as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_masses_on_three_springs_move_in_their_textbook_modes() {
        let mass = DMatrix::from_diagonal_element(2, 2, 2.0);
        let stiffness = DMatrix::from_row_slice(2, 2, &[16.0, -8.0, -8.0, 16.0]);
        let vibration = Vibration::of(&mass, &stiffness, 0.0);
        // In phase ω² = k/m = 4, in opposition 3 k/m = 12.
        let (mut d, mut v) = ([1.0, 0.0], [0.0, 0.0]);
        vibration.advance(0.7, &mut d, &mut v);
        let (slow, fast) = ((2.0 * 0.7_f64).cos(), (12.0_f64.sqrt() * 0.7).cos());
        assert!((d[0] - 0.5 * (slow + fast)).abs() < 1e-14, "{d:?}");
        assert!((d[1] - 0.5 * (slow - fast)).abs() < 1e-14, "{d:?}");
        let mut acceleration = [0.0; 2];
        vibration.acceleration(&[1.0, 0.0], &[0.0, 0.0], &mut acceleration);
        assert!((acceleration[0] + 8.0).abs() < 1e-13 && (acceleration[1] - 4.0).abs() < 1e-13);
    }

    #[test]
    fn a_mass_that_is_not_positive_gives_nan_and_returns() {
        let stiffness = DMatrix::identity(2, 2);
        for bad in [-1.0, 0.0, f64::NAN] {
            let vibration = Vibration::of(&DMatrix::from_diagonal_element(2, 2, bad), &stiffness, 0.0);
            let (mut d, mut v) = ([1.0, 0.0], [0.0, 0.0]);
            vibration.advance(0.1, &mut d, &mut v);
            assert!(d.iter().all(|d| d.is_nan()), "{bad}: {d:?}");
        }
    }
}
