//! The Windkessel observer: a pressure measured at the outlet corrects the pressure stored in the Windkessel.
//!
//! C dπ/dt = Q − π/R_d + γ (z − p)/R_d, where z is the measured pressure and p = π + R_p Q the predicted one. The theory has
//! z_π − π in place of z − p, with z_π = z − R_p Q of the true flow; here Q is the model's own, so that an error of the
//! outflow enters with R_p besides: it feeds waves back and bounds what the gain can reach. The gain γ has no unit here, it
//! counts in 1/(R_d C). The stored pressure is the slowest state of an arterial model and waves do not reach it, so that
//! observers of the wall's velocity leave it alone. Next file to read: [`super::nudging`].

use nalgebra::DMatrix;

use super::measured::mean_innovation;
use super::wall::{components, hosted};
use super::{Correction, Kind, Observer, Wiring};
use crate::SetupError;
use crate::setup::ObserverDef;
use crate::{Drive, Model, Spec};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "windkessel",
    says: "The measured outlet pressure pulls the pressure stored in the Windkessel; the gain counts in 1/(R_d C).",
    build: |def, wiring| Ok(Box::new(WindkesselObserver::new(def, wiring)?)),
};

/// Feedback of the outlet pressure on the Windkessel.
#[derive(Debug)]
pub(crate) struct WindkesselObserver {
    gain: f64,
    /// Position of π in the state.
    state: usize,
    /// Name of the pressure output.
    pressure: &'static str,
    /// The rows that show the pressure.
    rows: Vec<usize>,
}

impl WindkesselObserver {
    /// Finds the observed pressure.
    ///
    /// # Errors
    /// When the model has no Windkessel behind a wall or its pressure is not observed.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        let (block, pressure) = hosted(def, &wiring, |b| b.windkessel.zip(b.outputs.pressure))?;
        let rows: Vec<usize> = components(&wiring, pressure)?.into_iter().map(|(row, _)| row).collect();
        if rows.is_empty() {
            return Err(SetupError::Invalid(format!(
                "the observer `windkessel` needs the output `{pressure}` observed, and no channel has it: add a \
                 channel with `output = \"{pressure}\"`, estimate the initial pressure among the parameters, or \
                 take `sdf`, which corrects the pressure through the volume of the vessel"
            )));
        }
        Ok(Self { gain: def.gain, state: block.state, pressure, rows })
    }

    /// γ/(R_d C), in 1/time.
    fn rate(&self, model: &dyn Model, theta: &[f64]) -> f64 {
        let block = model.blocks(theta).and_then(|blocks| blocks.windkessel);
        block.map_or(0.0, |block| self.gain * block.rate)
    }

    /// ∂p/∂x, n_state: unit steps about rest, exact for a linear system.
    fn gradient(&self, model: &dyn Model, theta: &[f64]) -> Vec<f64> {
        let spec = model.spec();
        let rest = vec![0.0; spec.inputs.iter().map(|q| q.size).sum()];
        let drive = Drive { value: &rest, slope: &rest, ..Drive::NONE };
        let at = Spec::range_of(&spec.outputs, self.pressure).map_or(0, |range| range.start);
        let (mut x, mut y) = (vec![0.0; spec.n_state()], vec![0.0; spec.n_output()]);
        let mut pressure = |j: usize, value: f64| {
            x[j] = value;
            model.output(0.0, &x, theta, drive, &mut y);
            x[j] = 0.0;
            y[at]
        };
        (0..spec.n_state()).map(|j| 0.5 * (pressure(j, 1.0) - pressure(j, -1.0))).collect()
    }
}

impl Observer for WindkesselObserver {
    /// δπ = (1 − e^(−γΔt/(R_d C))) (z − p): exact for a held flow, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        if let Some((innovation, _)) = mean_innovation(&at, &self.rows) {
            let rate = self.rate(at.model, at.theta);
            x[self.state] += -(-rate * at.dt).exp_m1() * innovation;
        }
    }

    /// γ/(R_d C) ∂p/∂x in the row of π: the predicted pressure holds R_p times the model's own flow.
    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let (rate, mut feedback) = (self.rate(model, theta), DMatrix::zeros(n, n));
        for (entry, slope) in feedback.row_mut(self.state).iter_mut().zip(self.gradient(model, theta)) {
            *entry = rate * slope;
        }
        feedback
    }

    fn note(&self) -> Option<&'static str> {
        Some(
            "of corrections by the outlet pressure p = π + R_p Q with the model's own Q; with π itself measured there \
             would be no feedback of Q",
        )
    }
}
