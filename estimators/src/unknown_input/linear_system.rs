//! A linear system with one unknown input: its exact step and its response to a course of that input.
//!
//! Nothing is estimated here. Read next: `unknown_input.rs`.

use nalgebra::{DMatrix, DVector};

use crate::EstimatorError;

/// A linear system with one unknown input.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSystem {
    /// A, n x n, in 1/time unit.
    pub rate: DMatrix<f64>,
    /// B, n x m: what the known inputs add to the rates.
    pub known: DMatrix<f64>,
    /// g, length n: what the unknown input adds to the rates.
    pub unknown: DVector<f64>,
    /// C, p x n: the outputs.
    pub outputs: DMatrix<f64>,
}

/// One step of the states and the unknown input together: z⁺ = F z + G u + R Δu + noise of covariance σ² Q.
pub(super) struct Step {
    pub(super) transition: DMatrix<f64>,
    held: DMatrix<f64>,
    ramp: DMatrix<f64>,
    pub(super) noise: DMatrix<f64>,
}

impl LinearSystem {
    pub(super) fn n_state(&self) -> usize {
        self.rate.nrows()
    }

    /// A and g together, with the input as a last state that stays as it is.
    fn augmented(&self) -> DMatrix<f64> {
        let n = self.n_state();
        let mut rate = DMatrix::zeros(n + 1, n + 1);
        rate.view_mut((0, 0), (n, n)).copy_from(&self.rate);
        rate.view_mut((0, n), (n, 1)).copy_from(&self.unknown);
        rate
    }

    pub(super) fn step(&self, h: f64) -> Result<Step, EstimatorError> {
        let (n, m) = (self.n_state() + 1, self.known.ncols());
        let rate = self.augmented() * h;
        // exp of [[A h, B h, 0], [0, 0, 1], [0, 0, 0]]: what a held and a growing input make in a step.
        let mut block = DMatrix::zeros(n + 2 * m, n + 2 * m);
        block.view_mut((0, 0), (n, n)).copy_from(&rate);
        block.view_mut((0, n), (n - 1, m)).copy_from(&(&self.known * h));
        block.view_mut((n, n + m), (m, m)).fill_with_identity();
        let steps = block.exp();
        // exp of [[−A h, W h], [0, Aᵀ h]] (Van Loan 1978, eq. 1.4); W is one at the unknown input.
        let mut block = DMatrix::zeros(2 * n, 2 * n);
        block.view_mut((0, 0), (n, n)).copy_from(&-&rate);
        block.view_mut((n, n), (n, n)).copy_from(&rate.transpose());
        block[(n - 1, 2 * n - 1)] = h;
        let pair = block.exp();
        let noise = pair.view((n, n), (n, n)).tr_mul(&pair.view((0, n), (n, n)));
        if !steps.iter().chain(&noise).all(|v| v.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "the step of the linear system" });
        }
        Ok(Step {
            transition: steps.view((0, 0), (n, n)).into_owned(),
            held: steps.view((0, n), (n, m)).into_owned(),
            ramp: steps.view((0, n + m), (n, m)).into_owned(),
            noise: 0.5 * (&noise + noise.transpose()),
        })
    }

    /// The outputs (p x N) from rest, for known inputs (m x N) and an input in the unknown one's place (length N), all linear between
    /// samples; without noise.
    ///
    /// # Errors
    /// When shapes do not go together, or a step of this length has no finite numbers.
    pub fn response(
        &self,
        step: f64,
        inputs: &DMatrix<f64>,
        unknown: &[f64],
    ) -> Result<DMatrix<f64>, EstimatorError> {
        let (n, m) = (self.n_state(), self.known.ncols());
        shape("rows of the known inputs", m, inputs.nrows())?;
        shape("samples of the unknown input", inputs.ncols(), unknown.len())?;
        let mut known = self.known.clone().insert_column(m, 0.0);
        known.set_column(m, &self.unknown);
        let all = Self { known, ..self.clone() };
        let step = all.step(step)?;
        let mut inputs = inputs.clone().insert_row(m, 0.0);
        inputs.row_mut(m).copy_from_slice(unknown);
        let mut z = DVector::zeros(n + 1);
        let mut outputs = DMatrix::zeros(self.outputs.nrows(), unknown.len());
        for k in 0..unknown.len() {
            if k > 0 {
                z = step.forward(&z, &inputs, k);
            }
            outputs.set_column(k, &(&self.outputs * z.rows(0, n)));
        }
        Ok(outputs)
    }
}

impl Step {
    /// The mean at sample k from that at the one before.
    pub(super) fn forward(&self, z: &DVector<f64>, inputs: &DMatrix<f64>, k: usize) -> DVector<f64> {
        let (from, to) = (inputs.column(k - 1), inputs.column(k));
        &self.transition * z + &self.held * from + &self.ramp * (to - from)
    }
}

pub(super) fn shape(what: &'static str, expected: usize, got: usize) -> Result<(), EstimatorError> {
    if expected == got { Ok(()) } else { Err(EstimatorError::Shape { what, expected, got }) }
}
