//! What the report draws besides the explanation itself: curves, maps, forces, the distribution behind the false-alarm rate.
//!
//! Next file to read: [`super::result`].

use serde::{Deserialize, Serialize};

use crate::locate::{Located, RegionMap};

/// The data of the report's figures; kept in the run's database.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Time unit of the study.
    pub time_unit: String,
    /// Measured and simulated, by record and channel.
    pub curves: Vec<Curve>,
    /// Where the model before any effect disagrees with the data.
    pub before: Located,
    /// The maps of `before` with the effects in the model; empty when nothing was added.
    pub maps_after: Vec<RegionMap>,
    /// Largest fall of χ² of any candidate in each simulation without a gap, in units of the effective noise.
    pub null_gains: Vec<f64>,
    /// Largest fall of χ² of each decoy, in the same units.
    pub decoy_gains: Vec<f64>,
    /// Fall of χ² of the best candidate, in the same units.
    pub best_gain: f64,
}

/// One channel of one record: measured, and simulated before and after.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Record name.
    pub record: String,
    /// Output name.
    pub channel: String,
    /// Unit label.
    pub unit: String,
    /// Noise sd.
    pub noise: f64,
    /// Whether the channel is never fitted.
    pub held_out: bool,
    /// Training span; `None` when the whole record is held out.
    pub train: Option<[f64; 2]>,
    /// Times.
    pub time: Vec<f64>,
    /// Measured values.
    pub observed: Vec<f64>,
    /// Simulated without the effects.
    pub before: Vec<f64>,
    /// Simulated with the effects; empty when nothing was added.
    pub after: Vec<f64>,
}
