//! `[model.layout]` of the conical shell: its middle surface, which modes are taken, where it is struck and watched.
//!
//! Values that can be estimated are parameters and not here. Next file to read: [`super::model`].

use serde::Deserialize;
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use super::Cone;

/// Most modes of all numbers of waves together.
const MOST_MODES: usize = 1000;
/// Functions of each displacement: fewer give no mode to speak of, more lose the digits of Cholesky's factor.
const TERMS: [usize; 2] = [4, 40];
/// Most sensors.
const MOST_SENSORS: usize = 1000;

/// The layout as it is written.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Half angle at the apex in degrees.
    pub half_angle: f64,
    /// Distances of the clamped and of the free end from the apex along the surface, in m.
    pub ends: [f64; 2],
    /// Numbers of waves around that are taken.
    pub waves: Vec<usize>,
    /// Modes for each number of waves.
    pub modes: usize,
    /// Functions of each displacement.
    pub terms: usize,
    /// Whether in-plane motion has inertia.
    pub in_plane_inertia: bool,
    /// Distance of the load from the apex along the surface, in m; the angle is counted from it.
    pub source: f64,
    /// Distance in m and angle in degrees of each sensor.
    pub sensors: Vec<[f64; 2]>,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            half_angle: 20.0,
            ends: [1.5, 3.0],
            waves: vec![5, 6],
            modes: 2,
            terms: 16,
            in_plane_inertia: false,
            source: 2.8,
            sensors: vec![[3.0, 0.0], [2.5, 30.0]],
        }
    }
}

impl Layout {
    /// The cone of the layout.
    ///
    /// # Errors
    /// When a number is not usable or a point lies off the shell.
    pub(crate) fn check(&self) -> Result<Cone, SetupError> {
        if !(self.half_angle > 0.0 && self.half_angle < 90.0) {
            let message = format!("{} degrees is no cone: give an angle between 0 and 90", self.half_angle);
            return Err(fault("half_angle", message));
        }
        let [s1, s2] = self.ends;
        if !(s1 > 0.0 && s1 < s2 && s2.is_finite()) {
            let message =
                format!("a shell from {s1} m to {s2} m: give two distances from the apex, the smaller first");
            return Err(fault("ends", message));
        }
        self.check_modes()?;
        if self.sensors.is_empty() || self.sensors.len() > MOST_SENSORS {
            let message = format!("{} sensors: give 1 to {MOST_SENSORS}", self.sensors.len());
            return Err(fault("sensors", message));
        }
        self.on_shell("source", [self.source, 0.0])?;
        for (i, sensor) in self.sensors.iter().enumerate() {
            self.on_shell(&format!("sensors[{i}]"), *sensor)?;
        }
        Ok(Cone { half_angle: self.half_angle.to_radians(), ends: self.ends })
    }

    fn check_modes(&self) -> Result<(), SetupError> {
        let [least, most] = TERMS;
        if !(least..=most).contains(&self.terms) {
            let message = format!("{} functions: give {least} to {most}", self.terms);
            return Err(fault("terms", message));
        }
        // The upper half of the modes of a Ritz method is far too high.
        if self.modes == 0 || 2 * self.modes > self.terms {
            let message =
                format!("{} modes from {} functions: give 1 to {}", self.modes, self.terms, self.terms / 2);
            return Err(fault("modes", message));
        }
        for (i, waves) in self.waves.iter().enumerate() {
            let at = format!("waves[{i}]");
            if *waves == 0 {
                return Err(fault(&at, "no wave around is no bending of this kind: give 1 or more"));
            }
            if self.waves[..i].contains(waves) {
                return Err(fault(&at, format!("{waves} waves are given twice")));
            }
        }
        let n = self.waves.len().saturating_mul(self.modes);
        if n == 0 || n > MOST_MODES {
            let message = format!("{n} modes in all: give 1 to {MOST_MODES}");
            return Err(fault("waves", message));
        }
        Ok(())
    }

    fn on_shell(&self, path: &str, [s, angle]: [f64; 2]) -> Result<(), SetupError> {
        let [s1, s2] = self.ends;
        if s > s1 && s <= s2 && angle.is_finite() {
            return Ok(());
        }
        let message = format!(
            "s = {s} m at {angle} degrees is not on the shell, which is clamped at {s1} m and ends at {s2} m"
        );
        Err(fault(path, message))
    }
}
