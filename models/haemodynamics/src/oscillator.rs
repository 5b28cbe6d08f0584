//! The free linear oscillator: a mass on a spring with a viscous damper, released at the start.
//!
//! It has no input; [`super::driven_oscillator`] has a force. Next file to read: [`super::driven_oscillator`].

use nalgebra::DMatrix;
use starlings_models_core::blocks::WallOutputs;
use starlings_models_core::oscillation::free_motion;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Blocks, Drive, Model, ModelFailure, Quantity, Role, Spec};

/// m d²x/dt² + c dx/dt + k x = 0, with position x and velocity v as states and outputs.
pub struct Oscillator {
    spec: Spec,
}

/// The states of both oscillators.
pub(super) fn states() -> Vec<Quantity> {
    vec![
        Quantity::new("x", "m")
            .role(Role::Displacement)
            .default(INITIAL_POSITION)
            .says("Displacement of the mass from rest."),
        Quantity::new("v", "m/s").role(Role::Velocity).default(0.0).says("Velocity of the mass."),
    ]
}

/// The parameters of both oscillators.
pub(super) fn parameters() -> Vec<Quantity> {
    vec![
        Quantity::new("m", "kg").role(Role::Inertia).positive().says("Mass."),
        Quantity::new("c", "N s/m")
            .role(Role::Damping)
            .range(0.0, f64::INFINITY)
            .says("Viscous damping coefficient."),
        Quantity::new("k", "N/m").role(Role::Stiffness).positive().says("Spring stiffness."),
    ]
}

/// The outputs of both oscillators.
pub(super) fn outputs() -> Vec<Quantity> {
    vec![
        Quantity::new("position", "m").role(Role::Displacement).says("Displacement of the mass."),
        Quantity::new("velocity", "m/s").role(Role::Velocity).says("Velocity of the mass."),
    ]
}

/// The states that the outputs of both oscillators measure.
pub(super) fn measures() -> Vec<(String, String)> {
    vec![("position".to_owned(), "x".to_owned()), ("velocity".to_owned(), "v".to_owned())]
}

/// Both oscillators as a wall of one node in a vacuum.
pub(super) fn blocks(theta: &[f64]) -> Blocks {
    let one = |value: f64| DMatrix::from_element(1, 1, value);
    let (mass, stiffness) = (one(theta[0]), one(theta[2]));
    Blocks {
        displacement: 0,
        velocity: 1,
        mass: mass.clone(),
        trace: None,
        solid_mass: mass,
        added_mass: one(0.0),
        stiffness,
        windkessel: None,
        outputs: WallOutputs { displacement: "position", velocity: "velocity", pressure: None },
    }
}

/// Initial displacement when the study gives none: released from one unit.
pub(super) const INITIAL_POSITION: f64 = 1.0;

impl Default for Oscillator {
    fn default() -> Self {
        Self {
            spec: Spec {
                kind: "oscillator".to_owned(),
                says: "A mass on a spring with a viscous damper, moving freely.".to_owned(),
                states: states(),
                parameters: parameters(),
                outputs: outputs(),
                inputs: Vec::new(),
                measures: measures(),
                restart: true,
            },
        }
    }
}

impl Model for Oscillator {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x[0] = INITIAL_POSITION;
        x[1] = 0.0;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        let (mass, damping, stiffness) = (theta[0], theta[1], theta[2]);
        dx[0] = x[1];
        dx[1] = -(damping * x[1] + stiffness * x[0]) / mass;
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y.copy_from_slice(x);
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        Some(blocks(theta))
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        x.copy_from_slice(&free_motion(theta, segment.t1 - segment.t0, [x[0], x[1]]));
        Ok(())
    }
}
