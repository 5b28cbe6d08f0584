//! `[model.layout]` of the model `toy-fsi`: by sine modes or by finite elements.
//!
//! Next file to read: [`super::elements`].

use serde::{Deserialize, Serialize};
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use super::elements::Elements;
use super::spectral::Spectral;

/// Most unknowns of a dense system.
const MOST: usize = 1000;

/// The layout as it is written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Layout {
    /// Modes or elements; modes when it is not given.
    #[serde(default)]
    pub discretisation: Kind,
    /// Number of sine modes, and of nodes between the ends; 40 when it is not given.
    pub modes: Option<usize>,
    /// Cells along and across the channel; [40, 8] when they are not given.
    pub cells: Option<[usize; 2]>,
    /// w in the thickness h (1 + w sin πx/L) of the wall, above −1; 0 when it is not given.
    pub thickness_wave: Option<f64>,
}

/// How the system is discretised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    /// Sine modes, each with its own added mass.
    #[default]
    Modes,
    /// A string of linear elements over a channel of bilinear ones.
    Elements,
}

/// What stands behind a layout.
#[derive(Clone, Debug)]
pub(crate) enum Discretisation {
    /// Sine modes.
    Modes(Spectral),
    /// Finite elements.
    Elements(Elements),
}

impl Layout {
    /// Checks the numbers.
    ///
    /// # Errors
    /// When a number is out of range or belongs to the other discretisation.
    pub(crate) fn check(&self) -> Result<Discretisation, SetupError> {
        match self.discretisation {
            Kind::Modes => {
                refuse("cells", "elements", self.cells.is_some())?;
                refuse("thickness_wave", "elements", self.thickness_wave.is_some())?;
                Ok(Discretisation::Modes(Spectral::sines(count("modes", self.modes.unwrap_or(40), 1)?)))
            }
            Kind::Elements => {
                refuse("modes", "modes", self.modes.is_some())?;
                let [along, across] = self.cells.unwrap_or([40, 8]);
                let cells = [count("cells[0]", along, 2)?, count("cells[1]", across, 1)?];
                let wave = self.thickness_wave.unwrap_or(0.0);
                if !wave.is_finite() || wave <= -1.0 {
                    let message = format!("{wave} leaves no wall: give a number above -1");
                    return Err(fault("thickness_wave", message));
                }
                Ok(Discretisation::Elements(Elements::new(cells, wave)))
            }
        }
    }
}

/// A number of pieces within what a dense system can hold.
///
/// # Errors
/// When it is not.
pub(crate) fn count(path: &str, n: usize, least: usize) -> Result<usize, SetupError> {
    if (least..=MOST).contains(&n) {
        return Ok(n);
    }
    Err(fault(path, format!("{n} is out of range: give a whole number from {least} to {MOST}")))
}

fn refuse(key: &str, of: &str, given: bool) -> Result<(), SetupError> {
    if !given {
        return Ok(());
    }
    Err(fault(
        key,
        format!("it belongs to `discretisation = \"{of}\"`: remove it, or change the discretisation"),
    ))
}
