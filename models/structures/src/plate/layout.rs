//! `[model.layout]` of the plate: its lengths, how many modes are taken, where it is struck and watched.
//!
//! Values that can be estimated are parameters and not here. Next file to read: [`super::model`].

use serde::Deserialize;
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use super::Geometry;

/// Most modes of both directions together: their matrices are dense.
const MOST_MODES: usize = 1600;
/// Most sensors.
const MOST_SENSORS: usize = 1000;

/// The layout as it is written.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Lengths Lx and Ly in m.
    pub length: [f64; 2],
    /// Modes in each direction.
    pub modes: [usize; 2],
    /// Where the force acts, in m.
    pub source: [f64; 2],
    /// Where the displacement is measured, in m.
    pub sensors: Vec<[f64; 2]>,
}

impl Default for Layout {
    fn default() -> Self {
        Self { length: [2.0; 2], modes: [4; 2], source: [1.0; 2], sensors: vec![[0.35, 0.5], [1.6, 0.42]] }
    }
}

impl Layout {
    /// The plate of the layout.
    ///
    /// # Errors
    /// When a number is not usable or a point lies off the plate.
    pub(crate) fn check(&self) -> Result<Geometry, SetupError> {
        for (i, length) in self.length.iter().enumerate() {
            if !(length.is_finite() && *length > 0.0) {
                let message = format!("a plate of {length} m: give a length above zero");
                return Err(fault(&format!("length[{i}]"), message));
            }
        }
        let [nx, ny] = self.modes;
        if nx == 0 || ny == 0 || nx.saturating_mul(ny) > MOST_MODES {
            let message =
                format!("{nx} x {ny} modes: give at least one each way and at most {MOST_MODES} in all");
            return Err(fault("modes", message));
        }
        if self.sensors.is_empty() || self.sensors.len() > MOST_SENSORS {
            let message = format!("{} sensors: give 1 to {MOST_SENSORS}", self.sensors.len());
            return Err(fault("sensors", message));
        }
        self.on_plate("source", self.source)?;
        for (i, sensor) in self.sensors.iter().enumerate() {
            self.on_plate(&format!("sensors[{i}]"), *sensor)?;
        }
        Ok(Geometry { length: self.length, modes: self.modes })
    }

    /// Refuses a point that is not inside the plate: nothing moves at its edge.
    fn on_plate(&self, path: &str, [x, y]: [f64; 2]) -> Result<(), SetupError> {
        let [lx, ly] = self.length;
        if x > 0.0 && x < lx && y > 0.0 && y < ly {
            return Ok(());
        }
        let message =
            format!("({x}, {y}) is not inside the plate, which is {lx} m x {ly} m and rests at its edge");
        Err(fault(path, message))
    }
}
