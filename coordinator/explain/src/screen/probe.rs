//! A probe: the run of a candidate with a small amplitude, from which its influence is measured.
//!
//! Next file to read: [`super::response`].

use starlings_estimators::Score;

use super::influence::Influence;
use crate::fit::model_variant::ModelVariant;

/// A probe under way.
pub(super) struct Probe<'c> {
    pub(super) candidate: usize,
    pub(super) variant: ModelVariant<'c>,
    pub(super) point: Vec<f64>,
    pub(super) amplitude: f64,
    pub(super) answer: Option<Result<MeasuredInfluence, String>>,
}

/// An influence that was measured.
pub(super) struct MeasuredInfluence {
    pub(super) influence: Influence,
    pub(super) score: Score,
    /// Whether the rows that train feel nothing of it.
    pub(super) is_unfelt: bool,
}
