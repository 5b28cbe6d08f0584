//! What the screening measured of one candidate at one point of its grid.
//!
//! Next file to read: [`super::influence`].

use starlings_estimators::Score;

use super::influence::Influence;

/// A candidate that gains no more than chance is absorbed by the parameters when they cannot imitate less than this part of its
/// influence ...
const ABSORBED: f64 = 0.05;
/// ... and any candidate when it is less than this: an influence is a difference over a response of that share of the signal, and what
/// is left of it below is the curvature of the response.
pub(crate) const IMITATED: f64 = 3e-3;

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
    pub failure: Option<Unmeasured>,
    /// Whether it gains more than chance in units of the effective noise, or was asked for by name.
    pub is_significant: bool,
    /// Whether it may be refitted though the parameters imitate its slope at amplitude zero: it was asked for by name, or moves a state of its
    /// own, which stands still at that slope. It must gain more than chance all the same.
    pub may_be_imitated: bool,
}

/// The candidate changes nothing that is measured.
pub(super) const UNSEEN: Unmeasured = Unmeasured::NoInfluence("what was measured");

/// Why nothing is known of the influence of a candidate.
#[derive(Clone, Debug)]
pub(crate) enum Unmeasured {
    /// It has none, on what is named.
    NoInfluence(&'static str),
    /// It fits in no model with the effects of the fit, or its runs failed, as the text says.
    Failed(String),
}

impl Unmeasured {
    /// Name of the gate at which it is refused.
    pub(crate) fn gate(&self) -> &'static str {
        match self {
            Self::NoInfluence(_) => "no influence",
            Self::Failed(_) => "failed",
        }
    }

    /// The reason, for people.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::NoInfluence(on) => format!("no influence on {on}"),
            Self::Failed(reason) => reason.clone(),
        }
    }
}

impl ScreeningResult {
    /// Fall of χ², zero where physics does not allow the sign of the amplitude.
    pub(crate) fn allowed_gain(&self, sign: f64) -> f64 {
        if self.score.amplitude * sign >= 0.0 { self.score.gain } else { 0.0 }
    }

    /// Whether the parameters absorb it.
    pub(crate) fn is_absorbed(&self) -> bool {
        self.is_imitated()
            || (self.failure.is_none() && self.score.identifiable < ABSORBED && !self.is_significant)
    }

    /// Whether nothing of its influence is known to be its own.
    pub(crate) fn is_imitated(&self) -> bool {
        self.failure.is_none()
            && self.score.identifiable < IMITATED
            && !(self.may_be_imitated && self.score.sd.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_gains_no_more_than_chance_or_has_nothing_of_its_own_is_absorbed() {
        let result = |identifiable: f64, is_significant: bool| ScreeningResult {
            candidate: 0,
            point: Vec::new(),
            influence: Influence::none(),
            score: Score { gain: 4e4, amplitude: 1.0, sd: 0.01, identifiable },
            failure: None,
            is_significant,
            may_be_imitated: false,
        };
        assert!(!result(0.03, true).is_absorbed(), "two hundred standard deviations are no imitation");
        assert!(result(0.03, false).is_absorbed());
        assert!(result(0.001, true).is_absorbed(), "the curvature of the response");
        assert!(!result(0.06, false).is_absorbed());
        let asked = ScreeningResult { may_be_imitated: true, ..result(0.001, true) };
        assert!(!asked.is_absorbed(), "its slope at zero may say nothing of what it does where it matters");
    }
}
