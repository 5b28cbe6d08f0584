//! The error of the state under one observer, for any gain: de/dt = (A − Γ(γ)) e.
//!
//! Feedback is a polynomial in the gain, so that one observer is built thrice and then looked at for hundreds of gains. The
//! system is split into independent blocks once; blocks that the observer does not reach keep their poles. Next file to read:
//! [`super::gain`].

use nalgebra::{Complex, DMatrix};

use super::SpectrumError;
use super::component::{block, components};
use super::pole::{of_block, rightmost, sort};

/// Γ(γ) = γ Γ₁ + γ² Γ₂, in the same coordinates as A.
#[derive(Clone, Debug)]
pub struct Feedback {
    /// Γ₁ = ∂Γ/∂γ without observer.
    pub linear: DMatrix<f64>,
    /// Γ₂; zero but for the image force.
    pub quadratic: DMatrix<f64>,
}

impl Feedback {
    /// From the matrix at any gain; `None` when that is no such polynomial.
    ///
    /// # Errors
    /// Whatever `at` returns.
    pub fn of<E>(at: impl Fn(f64) -> Result<DMatrix<f64>, E>) -> Result<Option<Self>, E> {
        let (one, two, five) = (at(1.0)?, at(2.0)?, at(5.0)?);
        let quadratic = (&two - &one * 2.0) * 0.5;
        let feedback = Self { linear: &one - &quadratic, quadratic };
        // Rounding of a handful of sums.
        let close = (feedback.at(5.0) - &five).norm() <= 1e-12 * five.norm();
        Ok(close.then_some(feedback))
    }

    /// No feedback at all of n states.
    pub(crate) fn none(n: usize) -> Self {
        Self { linear: DMatrix::zeros(n, n), quadratic: DMatrix::zeros(n, n) }
    }

    /// Γ at a gain.
    pub(crate) fn at(&self, gain: f64) -> DMatrix<f64> {
        &self.linear * gain + &self.quadratic * (gain * gain)
    }
}

/// A model's error under one observer.
#[derive(Clone, Debug)]
pub struct ObservedSystem {
    /// What the observer reaches.
    pub(super) blocks: Vec<Block>,
    /// Poles of what it does not reach.
    pub(super) untouched: Vec<Complex<f64>>,
}

/// An independent block of A and of its feedback.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) a: DMatrix<f64>,
    pub(super) feedback: Feedback,
}

impl ObservedSystem {
    /// A model's linearisation under a feedback, both n_state × n_state in the same coordinates. Blocks are independent
    /// whose coupling is below `negligible` times the largest entry; zero unless the coordinates are orthogonal.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn new(a: &DMatrix<f64>, feedback: &Feedback, negligible: f64) -> Result<Self, SpectrumError> {
        let scale = (feedback.linear.amax(), feedback.quadratic.amax());
        let mut system = Self { blocks: Vec::new(), untouched: Vec::new() };
        for rows in components(&[a, &feedback.linear, &feedback.quadratic], negligible) {
            let own = block(a, &rows);
            let linear = block(&feedback.linear, &rows);
            let quadratic = block(&feedback.quadratic, &rows);
            if linear.amax() <= negligible * scale.0 && quadratic.amax() <= negligible * scale.1 {
                system.untouched.extend(of_block(own)?);
            } else {
                system.blocks.push(Block { a: own, feedback: Feedback { linear, quadratic } });
            }
        }
        Ok(system)
    }

    /// Refuses a gain at which every rate of the model is below the rounding of the feedback: its poles would be those of the
    /// feedback alone, or none that an iteration finds.
    ///
    /// # Errors
    /// [`SpectrumError::GainTooLarge`], with the gain from which on it is so.
    pub(crate) fn check_gain(&self, gain: f64) -> Result<(), SpectrumError> {
        for block in &self.blocks {
            let own = block.a.amax();
            // Of a model without rates nothing is lost.
            let visible = if own > 0.0 { own / f64::EPSILON } else { f64::MAX };
            let [linear, quadratic] = [block.feedback.linear.amax(), block.feedback.quadratic.amax()];
            let largest = (visible / linear).min((visible / quadratic).sqrt());
            if gain > largest {
                return Err(SpectrumError::GainTooLarge { gain, largest });
            }
        }
        Ok(())
    }

    /// All poles at a gain, sorted by modulus, then by imaginary part.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn poles(&self, gain: f64) -> Result<Vec<Complex<f64>>, SpectrumError> {
        let mut poles = self.untouched.clone();
        for block in &self.blocks {
            poles.extend(block.poles(gain)?);
        }
        sort(&mut poles);
        Ok(poles)
    }

    /// The largest real part of the poles at a gain, in 1/time: minus the rate at which the slowest error decays.
    ///
    /// # Errors
    /// As [`super::poles`].
    pub fn max_re(&self, gain: f64) -> Result<f64, SpectrumError> {
        let mut most = rightmost(&self.untouched);
        for block in &self.blocks {
            most = most.max(rightmost(&block.poles(gain)?));
        }
        Ok(most)
    }
}

impl Block {
    /// A − Γ at a gain, which may be negative for a difference.
    pub(super) fn at(&self, gain: f64) -> DMatrix<f64> {
        &self.a - self.feedback.at(gain)
    }

    /// The poles of the block, in no particular order.
    pub(super) fn poles(&self, gain: f64) -> Result<Vec<Complex<f64>>, SpectrumError> {
        of_block(self.at(gain))
    }
}
