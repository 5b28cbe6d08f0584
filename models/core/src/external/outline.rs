//! The program as a model of which nothing but the specification is known.
//!
//! Enough to check a setup against; it cannot be run. Next file to read: [`super::split`].

use super::split::Split;
use crate::SetupError;
use crate::setup::Setup;
use crate::solver::Description;
use crate::{Drive, Model, Spec};

/// A model that is only described.
pub(crate) struct Outline(Spec);

impl Outline {
    pub(crate) fn new(description: &Description) -> Self {
        Self(description.spec.clone())
    }
}

impl Model for Outline {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(f64::NAN);
    }

    fn rhs(&self, _t: f64, _x: &[f64], _theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        dx.fill(f64::NAN);
    }

    fn output(&self, _t: f64, _x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y.fill(f64::NAN);
    }
}

/// The program as a model that is only described.
pub fn outline(description: &Description) -> Box<dyn Model> {
    Box::new(Outline::new(description))
}

/// Refuses effects that the program cannot take.
///
/// # Errors
/// When there is one.
pub fn check_effects(setup: &Setup, description: &Description) -> Result<(), SetupError> {
    Split::of(&setup.written_out_effects(&description.spec)?, description).map(|_| ())
}
