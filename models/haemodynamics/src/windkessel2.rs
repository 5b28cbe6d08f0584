//! The two-element Windkessel (Frank 1899): an elastic chamber emptied through a resistance.
//!
//! Next file to read: [`super::windkessel3`].

use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelFailure, Quantity, Role, Spec};

use super::relaxation;

/// C dp/dt = q − p/R; the pressure is p.
pub struct Windkessel2 {
    spec: Spec,
}

/// The peripheral resistance, shared by all Windkessels.
pub(super) fn resistance() -> Quantity {
    Quantity::new("R", "mmHg s/mL")
        .role(Role::Resistance)
        .positive()
        .says("Peripheral resistance: mean pressure over mean flow.")
}

/// The total compliance, shared by all Windkessels.
pub(super) fn compliance() -> Quantity {
    Quantity::new("C", "mL/mmHg")
        .role(Role::Compliance)
        .positive()
        .says("Total arterial compliance: stored volume per pressure.")
}

/// The pressure across the compliance, shared by all Windkessels.
pub(super) fn stored_pressure() -> Quantity {
    Quantity::new("p", "mmHg")
        .role(Role::Pressure)
        .default(INITIAL_PRESSURE)
        .says("Pressure across the compliance.")
}

/// The output, shared by all Windkessels.
pub(super) fn pressure() -> Quantity {
    Quantity::new("pressure", "mmHg").role(Role::Pressure).says("Pressure at the inlet.")
}

/// The input, shared by all Windkessels.
pub(super) fn flow() -> Quantity {
    Quantity::new("flow", "mL/s").role(Role::Flow).says("Volume flow into the arterial tree.")
}

/// Initial pressure when the study gives none, a diastolic value in mmHg.
pub(super) const INITIAL_PRESSURE: f64 = 80.0;

/// Exact step of C dp/dt = q − p/R for a flow linear in time (`segment.u0[0]`, `segment.slope[0]`).
pub(super) fn advance_stored(segment: Segment<'_>, resistance: f64, compliance: f64, p: f64) -> f64 {
    let start = (segment.u0[0] - p / resistance) / compliance;
    let h = segment.t1 - segment.t0;
    relaxation::step(p, 1.0 / (resistance * compliance), start, segment.slope[0] / compliance, h)
}

impl Default for Windkessel2 {
    fn default() -> Self {
        Self {
            spec: Spec {
                kind: "windkessel-2".to_owned(),
                says: "An elastic artery emptied through the peripheral resistance.".to_owned(),
                states: vec![stored_pressure()],
                parameters: vec![resistance(), compliance()],
                outputs: vec![pressure()],
                inputs: vec![flow()],
                measures: vec![("pressure".to_owned(), "p".to_owned())],
                restart: true,
            },
        }
    }
}

impl Model for Windkessel2 {
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

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y[0] = x[0];
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        x[0] = advance_stored(segment, theta[0], theta[1], x[0]);
        Ok(())
    }
}
