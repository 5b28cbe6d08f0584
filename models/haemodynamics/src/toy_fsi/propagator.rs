//! The exact step of a linear system dx/dt = A x, by the exponential of A in coordinates whose square is an energy.
//!
//! A = S⁻¹ B S; in the coordinates S x a dissipative system has an exponential that never exceeds 1, whatever the units of x,
//! so scaling and squaring loses nothing (Al-Mohy & Higham 2009). A step over a time that was stepped before is one product.
//! Next file to read: [`super::super::toy_fsi_windkessel`].

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_models_core::exponential::exponential;

use starlings_models_core::cache::Cache;

/// A linear system and the steps already computed.
pub(crate) struct Propagator {
    /// B.
    energetic: DMatrix<f64>,
    /// S.
    to: DMatrix<f64>,
    /// S⁻¹.
    from: DMatrix<f64>,
    steps: Cache<DMatrix<f64>>,
}

impl Propagator {
    /// The system with B in energy coordinates, S into them and S⁻¹ back.
    pub(crate) fn new(energetic: DMatrix<f64>, to: DMatrix<f64>, from: DMatrix<f64>) -> Self {
        Self { energetic, to, from, steps: Cache::default() }
    }

    /// A in the coordinates of x.
    pub(crate) fn rate(&self) -> DMatrix<f64> {
        &self.from * &self.energetic * &self.to
    }

    /// e^(A h); NaN where A h is not finite or too large for a step to mean anything.
    pub(crate) fn step(&self, h: f64) -> Arc<DMatrix<f64>> {
        self.steps.get(&[h], || &self.from * exponential(&(&self.energetic * h)) * &self.to)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]

    use super::*;

    #[test]
    fn a_rotation_in_energy_coordinates_is_a_harmonic_oscillator_outside() {
        // dx = v, dv = −ω² x: energy coordinates (ω x, v) rotate by ω.
        let omega = 300.0;
        let rotation = DMatrix::from_row_slice(2, 2, &[0.0, omega, -omega, 0.0]);
        let scale = |s: f64| DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![s, 1.0]));
        let propagator = Propagator::new(rotation, scale(omega), scale(1.0 / omega));
        assert_eq!(propagator.rate()[(1, 0)], -omega * omega);
        let step = propagator.step(0.3);
        let expected = DMatrix::from_row_slice(
            2,
            2,
            &[90.0_f64.cos(), 90.0_f64.sin() / omega, -omega * 90.0_f64.sin(), 90.0_f64.cos()],
        );
        // A handful of squarings, each rounding once, of entries up to ω.
        assert!((&*step - expected).amax() < 1e-13 * omega, "{step}");
        for h in [f64::NAN, 1e37] {
            assert!(propagator.step(h).iter().all(|v| v.is_nan()), "{h}");
        }
    }
}
