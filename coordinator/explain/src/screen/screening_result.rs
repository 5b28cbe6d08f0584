//! What the screening measured of one candidate at one point of its grid.
//!
//! Next file to read: [`super::influence`].

use starlings_estimators::Score;

use super::influence::Influence;

/// Part of its own below which a candidate's influence counts as imitated by the parameters.
pub(crate) const ABSORBED: f64 = 0.05;

/// A candidate at one point of its grid, measured at a fit.
#[derive(Clone, Debug)]
pub(crate) struct ScreeningResult {
    /// Position among the candidates.
    pub candidate: usize,
    /// Values of its parameters after the amplitude.
    pub point: Vec<f64>,
    /// What it changes; nothing where there is none.
    pub influence: Influence,
    /// Its score.
    pub score: Score,
    /// Why it has no sensitivity.
    pub failure: Option<String>,
}

impl ScreeningResult {
    /// Fall of χ² with an amplitude of a sign that physics allows.
    pub(crate) fn allowed_gain(&self, sign: f64) -> f64 {
        if self.score.amplitude * sign >= 0.0 { self.score.gain } else { 0.0 }
    }

    /// Whether the parameters imitate it.
    pub(crate) fn is_absorbed(&self) -> bool {
        self.failure.is_none() && self.score.identifiable < ABSORBED
    }
}
