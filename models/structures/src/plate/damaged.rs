//! The normal modes of a plate that has lost stiffness in a patch: one symmetric eigenvalue problem.
//!
//! With D(1 − ε χ) Lap² w + ρh ∂²w/∂t² + 2δρh ∂w/∂t = f, where χ is one in the patch, the amplitudes c of the modes of the whole plate obey
//! c'' + 2δ c' + W² c = f + ε Λ W² c with W = diag(ω). In y = W c this is y'' + 2δ y' + W(1 − εΛ)W y = W f, which is symmetric
//! (Smelyanskiy, Luchinsky et al., eqs. 1.64 to 1.70; docs/structures.md says what is corrected). Next file to read:
//! [`super::inspection`].

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{Geometry, Material, Overlap, Patch};
use crate::modal::Modes;

/// Stiffness lost in a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damage {
    /// Where.
    pub patch: Patch,
    /// Share ε of the flexural stiffness that is lost there, from 0 to below 1.
    pub severity: f64,
}

/// Iterations of the eigenvalue problem per row; it takes two.
const ITERATIONS_PER_ROW: usize = 60;

/// Normal modes of the damaged plate, by amplitudes of those of the whole one.
#[derive(Clone, Debug)]
pub(crate) struct DamagedModes {
    pub(crate) modes: Modes,
    /// Uᵀ W, from c to the amplitudes of the damaged plate's modes.
    pub(crate) to: DMatrix<f64>,
    /// W⁻¹ U, back.
    pub(crate) from: DMatrix<f64>,
}

impl DamagedModes {
    /// The modes; everything is NaN when the numbers give no finite eigenvalues.
    pub(crate) fn new(geometry: &Geometry, material: &Material, damage: &Damage) -> Self {
        let frequencies = DVector::from_vec(geometry.frequencies(material));
        let n = frequencies.len();
        let mut k = Overlap::new(geometry.length, geometry.modes, damage.patch).dense() * -damage.severity;
        (0..n).for_each(|i| k[(i, i)] += 1.0);
        for (j, mut column) in k.column_iter_mut().enumerate() {
            column.component_mul_assign(&(&frequencies * frequencies[j]));
        }
        let finite = k.iter().all(|v| v.is_finite());
        let eigen =
            if finite { SymmetricEigen::try_new(k, f64::EPSILON, ITERATIONS_PER_ROW * n) } else { None };
        let Some(eigen) = eigen else {
            let lost = DMatrix::from_element(n, n, f64::NAN);
            let modes = Modes { squares: vec![f64::NAN; n], decay: material.decay };
            return Self { modes, to: lost.clone(), from: lost };
        };
        let (mut to, mut from) = (eigen.eigenvectors.transpose(), eigen.eigenvectors);
        for (i, omega) in frequencies.iter().enumerate() {
            to.column_mut(i).scale_mut(*omega);
            from.row_mut(i).scale_mut(1.0 / omega);
        }
        Self {
            modes: Modes { squares: eigen.eigenvalues.as_slice().to_vec(), decay: material.decay },
            to,
            from,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATERIAL: Material = Material { stiffness: 164_250.0, mass: 12.78, decay: 60.0 };

    fn squares(severity: f64, patch: Patch) -> Vec<f64> {
        let geometry = Geometry { length: [2.0; 2], modes: [6; 2] };
        let mut squares = DamagedModes::new(&geometry, &MATERIAL, &Damage { patch, severity }).modes.squares;
        squares.sort_by(f64::total_cmp);
        squares
    }

    #[test]
    fn a_patch_as_large_as_the_plate_lowers_every_frequency_alike() {
        let whole = Patch { centre: [1.0; 2], half_width: 1.0 };
        for (damaged, sound) in squares(0.19, whole).iter().zip(squares(0.0, whole)) {
            // Λ is the identity: rounding of a decomposition of 36 rows.
            assert!((damaged / sound - 0.81).abs() < 1e-12, "{damaged} for {sound}");
        }
    }

    #[test]
    fn a_small_loss_shifts_a_frequency_by_half_its_overlap() {
        let patch = Patch { centre: [0.5, 0.7], half_width: 0.025 };
        let shift = (squares(0.01, patch)[0] / squares(0.0, patch)[0]).sqrt() - 1.0;
        let overlap = Overlap::new([2.0; 2], [6; 2], patch).entry([1, 1], [1, 1]);
        // dω/ω = −ε Λ/2 to first order; the second is ε Λ ω_kl²/(ω_kl² − ω²) summed, some 36 of it.
        assert!((shift / (-0.005 * overlap) - 1.0).abs() < 0.01, "{shift:e} for {:e}", -0.005 * overlap);
    }

    #[test]
    fn the_ways_to_the_damaged_modes_and_back_are_inverse() {
        let geometry = Geometry { length: [2.0, 1.2], modes: [5, 4] };
        let damage = Damage { patch: Patch { centre: [0.5, 0.7], half_width: 0.1 }, severity: 0.3 };
        let damaged = DamagedModes::new(&geometry, &MATERIAL, &damage);
        let error = (&damaged.to * &damaged.from - DMatrix::identity(20, 20)).amax();
        // An orthogonal matrix of twenty rows, scaled by at most 25 and back.
        assert!(error < 1e-12, "{error:e}");
    }

    #[test]
    fn a_severity_that_is_no_number_gives_nan_and_returns() {
        let patch = Patch { centre: [0.5, 0.7], half_width: 0.1 };
        assert!(squares(f64::NAN, patch).iter().all(|square| square.is_nan()));
    }
}
