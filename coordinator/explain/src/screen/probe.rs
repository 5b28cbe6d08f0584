//! A probe: the run of a candidate with a small amplitude, from which its influence is measured.
//!
//! Next file to read: [`super::response`].

use starlings_estimators::Score;

use super::influence::Influence;
use super::screening_result::Unmeasured;
use crate::fit::model_variant::ModelVariant;

/// A candidate at one point of its grid, and its measurement as far as it has come.
pub(super) struct Probe<'c> {
    pub(super) candidate: usize,
    pub(super) variant: ModelVariant<'c>,
    pub(super) point: Vec<f64>,
    pub(super) amplitude: f64,
    pub(super) answer: Option<Result<MeasuredInfluence, Unmeasured>>,
}

/// A measured influence with its score.
pub(super) struct MeasuredInfluence {
    pub(super) influence: Influence,
    pub(super) score: Score,
    /// Whether it changes no training row.
    pub(super) is_unfelt: bool,
}
