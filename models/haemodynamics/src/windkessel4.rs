//! The four-element Windkessel with the inertance parallel to the characteristic impedance (Stergiopulos, Westerhof &
//! Westerhof 1999, Am. J. Physiol. 276, H81, model IV-Wk).
//!
//! The other four-element variant, with the inertance in series with the impedance, is deliberately not here: it needs the
//! derivative of the flow. At low frequency the inertance carries the whole flow, so mean pressure is R times mean flow.
//! Next file to read: [`super::oscillator`].

use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelFailure, Quantity, Role, Spec};

use super::relaxation;
use super::windkessel2::{
    INITIAL_PRESSURE, advance_stored, compliance, flow, pressure, resistance, stored_pressure,
};
use super::windkessel3::characteristic_impedance;

/// C dp/dt = q − p/R and L diL/dt = Zc (q − iL); the inlet pressure is p + Zc (q − iL).
pub(crate) struct Windkessel4 {
    spec: Spec,
}

impl Default for Windkessel4 {
    fn default() -> Self {
        let inertance = Quantity::new("L", "mmHg s^2/mL")
            .role(Role::Inertia)
            .positive()
            .says("Total arterial inertance, parallel to the characteristic impedance.");
        let branch_flow =
            Quantity::new("iL", "mL/s").role(Role::Flow).default(0.0).says("Flow through the inertance.");
        Self {
            spec: Spec {
                kind: "windkessel-4".to_owned(),
                says:
                    "A characteristic impedance with a parallel inertance, before an elastic artery and its \
                       peripheral resistance."
                        .to_owned(),
                states: vec![stored_pressure(), branch_flow],
                parameters: vec![
                    resistance(),
                    compliance(),
                    characteristic_impedance().positive(),
                    inertance,
                ],
                outputs: vec![pressure()],
                inputs: vec![flow()],
                measures: vec![("pressure".to_owned(), "p".to_owned())],
                restart: true,
            },
        }
    }
}

impl Model for Windkessel4 {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x[0] = INITIAL_PRESSURE;
        x[1] = 0.0;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let (resistance, compliance, impedance, inertance) = (theta[0], theta[1], theta[2], theta[3]);
        dx[0] = (u.value[0] - x[0] / resistance) / compliance;
        dx[1] = impedance * (u.value[0] - x[1]) / inertance;
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        y[0] = x[0] + theta[2] * (u.value[0] - x[1]);
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let rate = theta[2] / theta[3];
        let start = rate * (segment.u0[0] - x[1]);
        let h = segment.t1 - segment.t0;
        x[0] = advance_stored(segment, theta[0], theta[1], x[0]);
        x[1] = relaxation::step(x[1], rate, start, rate * segment.slope[0], h);
        Ok(())
    }
}
