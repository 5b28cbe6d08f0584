//! The layout of a lumped motor as a study writes it.
//!
//! Next file to read: [`super::quantities`].

use serde::Deserialize;
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use crate::grain::Grain;
use crate::throat::Throat;

/// What the study chooses; without one a steady cylindrical grain in SI units without noise.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Layout {
    /// Units of states and parameters.
    pub units: Units,
    /// The burning surface.
    pub grain: Grain,
    /// The course of the throat's area.
    pub throat: Throat,
    /// Noise of pressure and density; left out where nothing is said.
    pub noise: Option<Noise>,
}

/// Units of states and parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Units {
    /// m, kg, s, Pa.
    #[default]
    Si,
    /// Pressure in p_s, density in γ p_s/c_0², lengths in the bore's first radius; time stays in seconds.
    Scaled,
}

/// White noise of the rates of pressure and density, integrated by Heun's method.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Noise {
    /// Longest step in seconds.
    pub step: f64,
}

impl Layout {
    /// Refuses what no motor can be.
    ///
    /// # Errors
    /// [`SetupError::Layout`] with the place.
    pub(super) fn check(&self) -> Result<(), SetupError> {
        if let Some(Noise { step }) = self.noise
            && !(step > 0.0 && step.is_finite())
        {
            return Err(fault(
                "noise.step",
                format!("the step is {step}: give a number of seconds above zero"),
            ));
        }
        self.grain.check()
    }
}
