//! The Windkessel observer: a pressure measured at the outlet corrects the pressure stored in the Windkessel.
//!
//! C dπ/dt = Q − π/R_d + γ (z − p)/R_d, where z is the measured pressure and p = π + R_p Q the predicted one. The theory has
//! z_π − π in place of z − p, with z_π = z − R_p Q of the true flow; here Q is the model's own, so that an error of the
//! outflow enters with R_p besides: it feeds waves back and bounds what the gain can reach. The gain γ has no unit here, it
//! counts in 1/(R_d C). The stored pressure is the slowest state of an arterial model and waves do not reach it, so that
//! observers of the wall's velocity leave it alone. Next file to read: [`super::nudging`].

use nalgebra::DMatrix;

use super::measured::mean_innovation;
use super::slopes::slopes;
use super::wall::{components, hosted, names_no_states};
use super::{Correction, Kind, Observer, Wiring};
use crate::SetupError;
use crate::blocks::WindkesselBlock;
use crate::setup::ObserverDef;
use crate::{Model, Spec};

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "windkessel",
    says: "The measured outlet pressure pulls the pressure stored in the Windkessel; the gain counts in 1/(R_d C).",
    build: |def, wiring| Ok(Box::new(WindkesselObserver::new(def, wiring)?)),
};

/// Feedback of the pressures before outlets on the Windkessels behind them.
#[derive(Debug)]
pub(crate) struct WindkesselObserver {
    gain: f64,
    outlets: Vec<Outlet>,
}

/// A Windkessel whose pressure is observed.
#[derive(Debug)]
struct Outlet {
    /// Position of π in the state.
    state: usize,
    /// Name of the pressure output.
    pressure: String,
    /// The rows that show the pressure.
    rows: Vec<usize>,
}

/// The Windkessels of a model, each with the output that shows the pressure before it.
fn windkessels(model: &dyn Model, theta: &[f64]) -> Option<Vec<(WindkesselBlock, String)>> {
    if let Some(sections) = model.sections(theta) {
        return Some(sections.outlets);
    }
    let blocks = model.blocks(theta)?;
    let (block, pressure) = blocks.windkessel.zip(blocks.outputs.pressure)?;
    Some(vec![(block, pressure.to_owned())])
}

impl WindkesselObserver {
    /// Finds the observed pressures.
    ///
    /// # Errors
    /// When the model has no Windkessel behind a wall, or no pressure before one is observed.
    pub(crate) fn new(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Self, SetupError> {
        names_no_states(def)?;
        let all = if let Some(sections) = wiring.model.sections(wiring.theta) {
            sections.outlets
        } else {
            let (block, pressure) = hosted(def, &wiring, |b| b.windkessel.zip(b.outputs.pressure))?;
            vec![(block, pressure.to_owned())]
        };
        let names: Vec<String> = all.iter().map(|(_, pressure)| format!("`{pressure}`")).collect();
        let mut outlets = Vec::new();
        for (block, pressure) in all {
            let rows: Vec<usize> = components(&wiring, &pressure)?.into_iter().map(|(row, _)| row).collect();
            if !rows.is_empty() {
                outlets.push(Outlet { state: block.state, pressure, rows });
            }
        }
        if outlets.is_empty() {
            return Err(SetupError::Invalid(format!(
                "the observer `windkessel` needs the output {names} observed, and no channel has it: add a \
                 channel with it as `output`, estimate the initial pressure among the parameters, or \
                 take `sdf`, which corrects the pressure through the volume of the vessel",
                names = names.join(" or ")
            )));
        }
        Ok(Self { gain: def.gain, outlets })
    }

    /// γ/(R_d C) of a Windkessel, in 1/time.
    fn rate(&self, outlet: &Outlet, all: &[(WindkesselBlock, String)]) -> f64 {
        let block = all.iter().find(|(block, _)| block.state == outlet.state);
        block.map_or(0.0, |(block, _)| self.gain * block.rate)
    }
}

/// ∂p/∂x of an output, n_state.
fn gradient(model: &dyn Model, theta: &[f64], pressure: &str) -> Vec<f64> {
    let at = Spec::range_of(&model.spec().outputs, pressure).map_or(0, |range| range.start);
    let all: Vec<usize> = (0..model.spec().n_state()).collect();
    slopes(model, theta, &all).row(at).iter().copied().collect()
}

impl Observer for WindkesselObserver {
    /// δπ = (1 − e^(−γΔt/(R_d C))) (z − p): exact for a held flow, stable at any gain.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]) {
        let all = windkessels(at.model, at.theta).unwrap_or_default();
        for outlet in &self.outlets {
            if let Some((innovation, span)) = mean_innovation(&at, &outlet.rows) {
                let rate = self.rate(outlet, &all);
                x[outlet.state] += -(-rate * span).exp_m1() * innovation;
            }
        }
    }

    fn reads(&self) -> Vec<usize> {
        self.outlets.iter().flat_map(|outlet| &outlet.rows).copied().collect()
    }

    /// γ/(R_d C) ∂p/∂x in the row of each π: the predicted pressure holds R_p times the model's own flow.
    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64> {
        let n = model.spec().n_state();
        let all = windkessels(model, theta).unwrap_or_default();
        let mut feedback = DMatrix::zeros(n, n);
        for outlet in &self.outlets {
            let rate = self.rate(outlet, &all);
            let gradient = gradient(model, theta, &outlet.pressure);
            for (entry, slope) in feedback.row_mut(outlet.state).iter_mut().zip(gradient) {
                *entry = rate * slope;
            }
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
