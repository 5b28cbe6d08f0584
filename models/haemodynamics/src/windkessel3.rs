//! The three-element Windkessel (Westerhof, Elzinga & Sipkema 1971): a characteristic impedance before the chamber.
//!
//! Next file to read: [`super::windkessel4`].

use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelFailure, Quantity, Role, Spec};

use super::windkessel2::{
    INITIAL_PRESSURE, advance_stored, compliance, flow, pressure, resistance, stored_pressure,
};

/// C dp/dt = q − p/R; the inlet pressure is p + Zc q.
pub(crate) struct Windkessel3 {
    spec: Spec,
}

/// The characteristic impedance, shared with the four-element model.
pub(super) fn characteristic_impedance() -> Quantity {
    Quantity::new("Zc", "mmHg s/mL")
        .role(Role::Resistance)
        .range(0.0, f64::INFINITY)
        .says("Characteristic impedance of the proximal aorta.")
}

impl Default for Windkessel3 {
    fn default() -> Self {
        Self {
            spec: Spec {
                kind: "windkessel-3".to_owned(),
                says: "A characteristic impedance in series with an elastic artery and its peripheral resistance."
                    .to_owned(),
                states: vec![stored_pressure()],
                parameters: vec![resistance(), compliance(), characteristic_impedance()],
                outputs: vec![pressure()],
                inputs: vec![flow()],
                measures: vec![("pressure".to_owned(), "p".to_owned())],
                restart: true,
            },
        }
    }
}

impl Model for Windkessel3 {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x[0] = INITIAL_PRESSURE;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let (resistance, compliance) = (theta[0], theta[1]);
        dx[0] = (u.value[0] - x[0] / resistance) / compliance;
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        y[0] = x[0] + theta[2] * u.value[0];
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        x[0] = advance_stored(segment, theta[0], theta[1], x[0]);
        Ok(())
    }
}
