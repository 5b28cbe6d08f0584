//! Values at equal nodes of the wall and their amplitudes in sines or quarter-wave cosines: orthonormal discrete transforms.
//!
//! Both transforms are symmetric and their own inverse (sine of type I, cosine of type IV; Strang 1999), so n nodes carry
//! exactly n modes and an operator that is diagonal in the modes is dense in the nodes. Next file to read:
//! [`super::vibration`].

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, DVectorView};

/// What holds at the ends of the wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// No displacement at x = 0 and x = L: sin iπx/L at x = jL/(n + 1).
    Fixed,
    /// No slope at x = 0, no displacement at x = L: cos (i − ½)πx/L at x = (j − ½)L/n.
    FreeAndFixed,
}

/// n nodes and n modes of a wall.
#[derive(Clone, Debug)]
pub(crate) struct Spectral {
    ends: Ends,
    transform: DMatrix<f64>,
}

impl Spectral {
    /// Sines, for a wall that is fixed at both ends.
    pub(crate) fn sines(n: usize) -> Self {
        let wave = PI / (n + 1) as f64;
        let scale = (2.0 / (n + 1) as f64).sqrt();
        let entry = |i: usize, j: usize| scale * (wave * ((i + 1) * (j + 1)) as f64).sin();
        Self { ends: Ends::Fixed, transform: DMatrix::from_fn(n, n, entry) }
    }

    /// Quarter-wave cosines, for a wall that is fixed at x = L only.
    pub(crate) fn quarter_waves(n: usize) -> Self {
        let wave = PI / (4 * n) as f64;
        let scale = (2.0 / n as f64).sqrt();
        let entry = |i: usize, j: usize| scale * (wave * ((2 * i + 1) * (2 * j + 1)) as f64).cos();
        Self { ends: Ends::FreeAndFixed, transform: DMatrix::from_fn(n, n, entry) }
    }

    /// Number of nodes and of modes.
    pub(crate) fn len(&self) -> usize {
        self.transform.nrows()
    }

    /// Length of wall that belongs to a node.
    pub(crate) fn spacing(&self, length: f64) -> f64 {
        match self.ends {
            Ends::Fixed => length / (self.len() + 1) as f64,
            Ends::FreeAndFixed => length / self.len() as f64,
        }
    }

    /// Places x/L of the nodes.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = f64> {
        let (shift, spacing) = match self.ends {
            Ends::Fixed => (1.0, self.spacing(1.0)),
            Ends::FreeAndFixed => (0.5, self.spacing(1.0)),
        };
        (0..self.len()).map(move |j| (j as f64 + shift) * spacing)
    }

    /// Wave numbers κ of the modes.
    pub(crate) fn wave_numbers(&self, length: f64) -> Vec<f64> {
        let shift = if self.ends == Ends::Fixed { 1.0 } else { 0.5 };
        (0..self.len()).map(|i| (i as f64 + shift) * PI / length).collect()
    }

    /// The transform, nodes to modes and back.
    pub(crate) fn transform(&self) -> &DMatrix<f64> {
        &self.transform
    }

    /// Amplitudes of nodal values, or nodal values of amplitudes.
    pub(crate) fn apply(&self, values: &[f64]) -> DVector<f64> {
        &self.transform * DVectorView::from_slice(values, values.len())
    }

    /// The nodal matrix of an operator that multiplies mode i by `diagonal(i)`; symmetric to the last bit.
    pub(crate) fn operator(&self, diagonal: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let mut scaled = self.transform.clone();
        for (i, mut column) in scaled.column_iter_mut().enumerate() {
            column *= diagonal(i);
        }
        let product = scaled * &self.transform;
        0.5 * (&product + product.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_are_symmetric_and_their_own_inverse() {
        for spectral in [Spectral::sines(12), Spectral::quarter_waves(13)] {
            let t = spectral.transform();
            let square = t * t - DMatrix::identity(t.nrows(), t.nrows());
            // Sums of a dozen products, each rounded.
            assert!(square.amax() < 1e-14, "{square}");
            assert!((t - t.transpose()).amax() < 1e-15);
        }
    }

    #[test]
    fn an_amplitude_is_the_mode_at_the_nodes() {
        for (spectral, wave) in [
            (Spectral::sines(9), f64::sin as fn(f64) -> f64),
            (Spectral::quarter_waves(9), f64::cos as fn(f64) -> f64),
        ] {
            let kappa = spectral.wave_numbers(2.0)[3];
            let values: Vec<f64> = spectral.nodes().map(|xi| wave(kappa * 2.0 * xi)).collect();
            let amplitudes = spectral.apply(&values);
            let scale = (1.0 / spectral.spacing(2.0)).sqrt();
            for (i, amplitude) in amplitudes.iter().enumerate() {
                let expected = if i == 3 { scale } else { 0.0 };
                // ∫ wave² over a length of 2 is 1; sums of nine rounded products.
                assert!((amplitude - expected).abs() < 1e-13, "{i}: {amplitude} for {expected}");
            }
        }
    }
}
