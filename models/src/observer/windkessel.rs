//! The Windkessel observer: a pressure measured at the outlet corrects the pressure stored in the Windkessel.
//!
//! C dπ/dt = Q − π/R_d + γ (z_π − π)/R_d, where what is measured is p = π + R_p Q: with the predicted flow, z_π − π is
//! observed − predicted pressure. The gain γ has no unit here, it counts in 1/(R_d C). The stored pressure is the slowest state of
//! an arterial model and waves do not reach it, so that observers of the wall's velocity leave it alone. Next file to read:
//! [`super::nudging`].

use nalgebra::DMatrix;

use super::wall::{components, hosted};
use super::{Correction, Kind, Observer, Wiring};
use crate::Model;
use crate::setup::{ObserverDef, SetupError};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "windkessel",
    says: "The measured outlet pressure pulls the pressure stored in the Windkessel; the gain counts in 1/(R_d C).",
    build: |def, wiring| Ok(Box::new(WindkesselObserver::new(def, wiring)?)),
};

/// Feedback of the outlet pressure on the Windkessel.
#[derive(Debug)]
pub struct WindkesselObserver {
    gain: f64,
    /// Position of π in the state.
    state: usize,
    /// The rows that show the pressure.
    rows: Vec<usize>,
}

impl WindkesselObserver {
    /// Finds the observed pressure.
    ///
    /// # Errors
    /// When the model has no Windkessel behind a wall or its pressure is not observed.
    pub fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        let (block, pressure) = hosted(def, &wiring, |b| b.windkessel.zip(b.outputs.pressure))?;
        let rows: Vec<usize> = components(&wiring, pressure)?.into_iter().map(|(row, _)| row).collect();
        if rows.is_empty() {
            return Err(SetupError::Invalid(format!(
                "the observer `windkessel` needs the output `{pressure}` observed, and no channel has it: add a \
                 channel with `output = \"{pressure}\"`, estimate the initial pressure among the parameters, or \
                 take `sdf`, which corrects the pressure through the volume of the vessel"
            )));
        }
        Ok(Self { gain: def.gain, state: block.state, rows })
    }

    /// γ/(R_d C), in 1/time.
    fn rate(&self, model: &dyn Model, theta: &[f64]) -> f64 {
        let block = model.blocks(theta).and_then(|blocks| blocks.windkessel);
        block.map_or(0.0, |block| self.gain * block.rate)
    }
}

impl Observer for WindkesselObserver {
    /// δπ = (1 − e^(−γΔt/(R_d C))) (z − p): exact for a held flow, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let (mut sum, mut n) = (0.0, 0_u32);
        for &row in self.rows.iter().filter(|&&row| !at.observed[row].is_nan()) {
            sum += at.observed[row] - at.predicted[row];
            n += 1;
        }
        if n > 0 {
            let rate = self.rate(at.model, at.theta);
            x[self.state] += -(-rate * at.dt).exp_m1() * sum / f64::from(n);
        }
    }

    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let mut feedback = DMatrix::zeros(n, n);
        feedback[(self.state, self.state)] = self.rate(model, theta);
        feedback
    }
}
