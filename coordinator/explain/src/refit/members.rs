//! The members of a pair alone, from where the pair stands.
//!
//! A pair is named where both of its members contribute, which only a fit of each alone can tell; and what either does alone may not have
//! been seen before, where the model as it is lies too far from it. Next file to read: [`super::pairs`].

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::ModelVariant;
use crate::judge::search_result::SearchResult;

impl<'c> Searcher<'_, '_, 'c> {
    /// Refits of each member of the best of these variants, where that is a pair, unless it was refitted alone.
    pub(super) fn members_alone(
        &mut self,
        found: &SearchResult<'c>,
        refitted: &[FittedVariant<'c>],
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let best = refitted.iter().min_by(|a, b| a.cost().total_cmp(&b.cost()));
        let Some(pair) = best.filter(|fit| fit.variant.effects.len() == 2) else { return Ok(Vec::new()) };
        let variant = &pair.variant;
        let known = found.judged.iter().map(|judged| &judged.fit).chain(refitted);
        let refitted_alone: Vec<usize> = known
            .filter(|fit| fit.variant.effects.len() == 1 && fit.variant.left_out == variant.left_out)
            .map(|fit| fit.variant.effects[0].index)
            .collect();
        let mut begun = Vec::new();
        for effect in variant.effects.iter().filter(|effect| !refitted_alone.contains(&effect.index)) {
            let alone = ModelVariant::new(variant.base, vec![effect.clone()], &variant.left_out)?;
            let start = alone.continue_from(variant, pair.z(), &[]);
            begun.push(FittedVariant::begin(alone, start));
        }
        let mut fits = self.refit(begun)?;
        // Without a run, for it failed or the budget ended before it, there is nothing to judge.
        fits.retain(|fit| !fit.residual().is_empty());
        Ok(fits)
    }

    /// Pairs that ended above one of their members alone, as no pair does at its best, refitted from there.
    pub(super) fn none_above_its_parts(
        &mut self,
        found: &SearchResult<'c>,
        mut fits: Vec<FittedVariant<'c>>,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let (mut begun, mut places) = (Vec::new(), Vec::new());
        for (place, pair) in fits.iter().enumerate().filter(|(_, fit)| fit.variant.effects.len() == 2) {
            let known = found.judged.iter().map(|judged| &judged.fit).chain(&fits);
            let parts = known.filter(|fit| is_part(fit, pair) && fit.cost() < pair.cost());
            let Some(part) = parts.min_by(|a, b| a.cost().total_cmp(&b.cost())) else { continue };
            let alone = part.variant.effects[0].index;
            let other = usize::from(pair.variant.effects[0].index == alone);
            let variant = pair.variant.clone();
            let start = variant.continue_from(&part.variant, part.z(), &pair.values_of(other)[1..]);
            begun.push(FittedVariant::begin(variant, start));
            places.push(place);
        }
        for (place, fit) in places.into_iter().zip(self.refit(begun)?) {
            if !fit.residual().is_empty() && fit.cost() < fits[place].cost() {
                fits[place] = fit;
            }
        }
        Ok(fits)
    }
}

/// Whether a variant is a pair less one of its effects.
fn is_part(fit: &FittedVariant<'_>, pair: &FittedVariant<'_>) -> bool {
    let (own, of_pair) = (&fit.variant, &pair.variant);
    own.left_out == of_pair.left_out
        && own.effects.len() == 1
        && of_pair.effects.iter().any(|effect| effect.index == own.effects[0].index)
}
