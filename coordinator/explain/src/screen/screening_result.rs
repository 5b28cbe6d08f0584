//! What the screening measured of one candidate at one point of its grid.
//!
//! Next file to read: [`super::influence`].

use starlings_estimators::Score;

use super::influence::Influence;

/// A candidate is absorbed by the parameters when they cannot imitate less than this part of its influence.
pub(crate) const ABSORBED: f64 = 0.05;

/// The screening of a candidate at one point of its grid.
#[derive(Clone, Debug)]
pub(crate) struct ScreeningResult {
    /// Position among the candidates.
    pub candidate: usize,
    /// Values of its parameters after the amplitude.
    pub point: Vec<f64>,
    /// Its influence; without values where it was not measured.
    pub influence: Influence,
    /// Its score.
    pub score: Score,
    /// Why its influence was not measured.
    pub failure: Option<String>,
}

impl ScreeningResult {
    /// Fall of χ², zero where physics does not allow the sign of the amplitude.
    pub(crate) fn allowed_gain(&self, sign: f64) -> f64 {
        if self.score.amplitude * sign >= 0.0 { self.score.gain } else { 0.0 }
    }

    /// Whether the parameters absorb it.
    pub(crate) fn is_absorbed(&self) -> bool {
        self.failure.is_none() && self.score.identifiable < ABSORBED
    }
}
