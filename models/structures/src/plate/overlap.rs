//! How much of the modes of a plate lies in a rectangular patch, and how the patch couples them.
//!
//! Closed form of ∫∫ over the patch; a patch that reaches over the edge is cut there. Next file to read: [`super::inspection`].

use std::f64::consts::PI;

use nalgebra::{DMatrix, DMatrixView};

/// A square patch of the plate, |x − x_d| < d, |y − y_d| < d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Centre (x_d, y_d) in m.
    pub centre: [f64; 2],
    /// Half width d in m.
    pub half_width: f64,
}

/// Λ_(mn,kl) = X_mk Y_nl: 4/(Lx Ly) ∫∫ of the product of two modes over a patch, a Kronecker product of the two directions.
#[derive(Clone, Debug)]
pub struct Overlap {
    along: DMatrix<f64>,
    across: DMatrix<f64>,
}

impl Overlap {
    /// The overlap of the modes of a plate of these lengths, so many modes in each direction.
    pub fn new(length: [f64; 2], modes: [usize; 2], patch: Patch) -> Self {
        let one = |i: usize| direction(length[i], modes[i], patch.centre[i], patch.half_width);
        Self { along: one(0), across: one(1) }
    }

    /// Entry of modes (m, n) and (k, l), counted from 1.
    pub fn entry(&self, [m, n]: [usize; 2], [k, l]: [usize; 2]) -> f64 {
        self.along[(m - 1, k - 1)] * self.across[(n - 1, l - 1)]
    }

    /// The whole matrix, in the order of the plate's modes: n runs faster than m.
    pub fn dense(&self) -> DMatrix<f64> {
        self.along.kronecker(&self.across)
    }

    /// Λ v.
    pub fn apply(&self, v: &[f64]) -> Vec<f64> {
        let v = DMatrixView::from_slice(v, self.across.nrows(), self.along.nrows());
        // Both directions are symmetric.
        (&self.across * v * &self.along).as_slice().to_vec()
    }
}

/// (2/L) ∫ sin(mπx/L) sin(kπx/L) over one side of the patch: (S⁻ − S⁺)/π with S^∓ = sin((k ∓ m)πx/L)/(k ∓ m) between the ends, for
/// k = m the length of the side times π/L.
fn direction(length: f64, modes: usize, centre: f64, half_width: f64) -> DMatrix<f64> {
    let a = (centre - half_width).clamp(0.0, length) * PI / length;
    let b = (centre + half_width).clamp(0.0, length) * PI / length;
    let wave = |n: f64| if n.abs() < 0.5 { b - a } else { ((n * b).sin() - (n * a).sin()) / n };
    DMatrix::from_fn(modes, modes, |m, k| (wave(k.abs_diff(m) as f64) - wave((k + m + 2) as f64)) / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simpson's rule over the patch, `n` even.
    fn simpson(from: f64, to: f64, n: usize, f: impl Fn(f64) -> f64) -> f64 {
        let h = (to - from) / n as f64;
        let weight = |i: usize| {
            if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        (0..=n).map(|i| weight(i) * f(from + i as f64 * h)).sum::<f64>() * h / 3.0
    }

    fn by_quadrature(length: f64, m: usize, k: usize, [from, to]: [f64; 2]) -> f64 {
        let wave = |n: usize, x: f64| (n as f64 * PI * x / length).sin();
        2.0 / length * simpson(from, to, 400, |x| wave(m, x) * wave(k, x))
    }

    #[test]
    fn every_entry_is_the_integral_over_the_patch() {
        let (length, modes) = ([2.0, 1.5], [20, 12]);
        for (patch, ends) in [
            (Patch { centre: [0.5, 0.7], half_width: 0.025 }, [[0.475, 0.525], [0.675, 0.725]]),
            (Patch { centre: [1.1, 0.4], half_width: 0.2 }, [[0.9, 1.3], [0.2, 0.6]]),
            // Cut at two edges.
            (Patch { centre: [0.02, 1.45], half_width: 0.1 }, [[0.0, 0.12], [1.35, 1.5]]),
        ] {
            let overlap = Overlap::new(length, modes, patch);
            for (m, n, k, l) in [(1, 1, 1, 1), (3, 1, 5, 1), (2, 3, 4, 5), (20, 12, 20, 12), (19, 2, 20, 11)]
            {
                let expected =
                    by_quadrature(length[0], m, k, ends[0]) * by_quadrature(length[1], n, l, ends[1]);
                let found = overlap.entry([m, n], [k, l]);
                // Simpson's error with 400 intervals is (20·π·0.001/2)⁴/180 of the integrand, below 1e-9.
                assert!((found - expected).abs() < 1e-9, "{m}{n},{k}{l}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn the_entries_of_the_reference_plate_have_their_published_digits() {
        let overlap = |centre| Overlap::new([2.0; 2], [20; 2], Patch { centre, half_width: 0.025 });
        let at = overlap([0.5, 0.5]);
        // As many digits as the reference gives.
        assert!((at.entry([1, 1], [1, 1]) - 6.2500e-4).abs() < 5e-9);
        assert!((at.entry([3, 1], [5, 1]) + 6.1477e-4).abs() < 5e-9);
        let along = at.entry([3, 1], [5, 1]) / at.entry([1, 1], [1, 1]).sqrt();
        assert!((along + 2.459_079e-2).abs() < 5e-9, "{along}");
    }

    #[test]
    fn applying_it_is_the_product_with_the_dense_matrix() {
        let overlap = Overlap::new([2.0, 1.0], [4, 3], Patch { centre: [0.5, 0.7], half_width: 0.1 });
        let v: Vec<f64> = (0..12).map(|i| f64::from(i).cos()).collect();
        let dense = overlap.dense() * nalgebra::DVector::from_vec(v.clone());
        let found = overlap.apply(&v);
        // Sums of twelve products below one.
        assert!((0..12).all(|i| (found[i] - dense[i]).abs() < 1e-15));
        let entry = overlap.dense()[(1, 7)];
        assert!((entry - overlap.entry([1, 2], [3, 2])).abs() < 1e-18, "n runs faster");
    }
}
