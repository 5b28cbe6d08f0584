//! What a search found: the model as it is, the screening, and every variant that was refitted.
//!
//! The search (`refit/search.rs`) fills it; the verdict and the result of the explanation are made from it. Next file to read:
//! [`super::contribution`].

use super::adequacy::Adequacy;
use super::gates::JudgedFit;
use super::held_out::HeldOut;
use super::misfit::Misfit;
use super::null_distribution::NullDistribution;
use crate::fit::fitted_variant::FittedVariant;
use crate::screen::screening_result::ScreeningResult;

/// Everything that the search found.
pub(crate) struct SearchResult<'c> {
    /// The model as it is.
    pub base: FittedVariant<'c>,
    /// Its misfit.
    pub before: Misfit,
    /// Its training residuals against the stated noise.
    pub adequacy: Adequacy,
    /// Its errors on held-out data.
    pub held_out: Vec<HeldOut>,
    /// The scores that a search reaches by chance.
    pub null_distribution: NullDistribution,
    /// The screening at the model as it is, every candidate and grid point.
    pub screening: Vec<ScreeningResult>,
    /// Largest fall of χ² in the screening, to first order, with an amplitude of a sign that physics allows.
    pub largest_gain: f64,
    /// Every variant that was refitted, the best first.
    pub judged: Vec<JudgedFit<'c>>,
    /// Terms that were looked at for every one of those that were made from the data and tried; 1 without any.
    pub looked_at: f64,
    /// Whether the budget cut the search short.
    pub cut_short: bool,
}

impl SearchResult<'_> {
    /// Positions of the variants that pass every gate, the best first.
    pub(crate) fn passing(&self) -> Vec<usize> {
        (0..self.judged.len()).filter(|i| self.judged[*i].refusal.is_none()).collect()
    }
}
