//! The parts of a set of effects, refitted from where the set ended.
//!
//! The fit of one effect may end in a hollow from which only a second effect leads out. Where that one is then no larger than a search makes
//! it by chance, the set has told where the first one fits alone. Next file to read: [`super::second_pass`].

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::ModelVariant;
use crate::judge::search_result::SearchResult;

impl<'c> Searcher<'_, '_, 'c> {
    /// Leaves out each effect of the best variant whose amplitude is zero to within what a search reaches by chance, and refits the others.
    /// Of several fits of one variant the best is kept. Whether any was made.
    pub(super) fn refit_parts(&mut self, found: &mut SearchResult<'c>) -> Result<bool, ExplainError> {
        let best = found.judged.first().filter(|j| j.refusal.is_none() && j.fit.variant.effects.len() > 1);
        let Some(best) = best else { return Ok(false) };
        let (variant, z) = (&best.fit.variant, best.fit.z());
        let optimum = best.fit.optimum()?;
        let by_chance = found.null_distribution.threshold * best.inflation;
        let mut fits = Vec::new();
        for m in 0..variant.effects.len() {
            let amplitude = variant.first_entry_of(m);
            let variance = optimum.covariance()[(amplitude, amplitude)];
            if z[amplitude].powi(2) > by_chance * variance {
                continue;
            }
            let mut others = variant.effects.clone();
            others.remove(m);
            let part = ModelVariant::new(variant.base, others, &variant.left_out)?;
            let start = part.continue_from(variant, z, &[]);
            fits.push(FittedVariant::begin(part, start));
        }
        if fits.is_empty() {
            return Ok(false);
        }
        self.cache.stage("refit", &format!("{} parts of {}", fits.len(), variant.name()));
        let fits = self.refit(fits)?;
        self.judge_all(found, fits)?;
        found.keep_best_of_each();
        Ok(true)
    }
}
