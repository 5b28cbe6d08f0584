//! Simpler terms in place of a member of a pair.
//!
//! A term with values inside may stand for a simpler one, of which it has a limit: a saturation far from its half, a store that never fills.
//! Of pairs few are refitted, and among them the simpler need not be. Next file to read: [`super::pairs`].

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::search_result::SearchResult;

impl<'c> Searcher<'_, '_, 'c> {
    /// Refits the best pair with generic terms that have no values inside in place of one that has, in the same equation.
    pub(super) fn refit_simpler(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        let Some(pair) = found.judged.first().filter(|j| j.refusal.is_none()).map(|j| &j.fit) else {
            return Ok(());
        };
        let [a, b] = pair.variant.effects.as_slice() else { return Ok(()) };
        let mut begun = Vec::new();
        for (stays, goes) in [(a, b), (b, a)].into_iter().filter(|(_, goes)| goes.candidate.n_inner() > 0) {
            for simple in self.simple_in_place_of(found, goes) {
                let known = found.judged.iter().map(|j| &j.fit.variant.effects);
                let is_pair = |of: &Vec<AddedEffect<'_>>| {
                    of.len() == 2 && of.iter().all(|e| [stays.index, simple.index].contains(&e.index))
                };
                if simple.index != stays.index && !known.into_iter().any(is_pair) {
                    let effects = vec![stays.clone(), simple];
                    // Two effects that share a name cannot be in one model.
                    let of = &pair.variant;
                    let Ok(variant) = ModelVariant::new(of.base, effects, &of.left_out) else { continue };
                    let start = variant.continue_from(of, pair.z(), &[]);
                    begun.push(FittedVariant::begin(variant, start));
                }
            }
        }
        self.cache.stage("refit", &format!("{} simpler pairs", begun.len()));
        let first = self.first_of(begun)?;
        let fits = self.refit(first)?;
        self.judge_all(found, fits)
    }

    /// The generic terms without values inside that were screened and enter the equation of an effect.
    fn simple_in_place_of(&self, found: &SearchResult<'c>, effect: &AddedEffect<'c>) -> Vec<AddedEffect<'c>> {
        let enters = |c: usize| self.candidates[c].def.adds.first().map(|add| &add.to);
        let of = effect.candidate.def.adds.first().map(|add| &add.to);
        let simple = found.screening.iter().filter(|h| {
            let candidate = &self.candidates[h.candidate];
            candidate.kind == Kind::Generic
                && candidate.n_inner() == 0
                && h.failure.is_none()
                && enters(h.candidate) == of
        });
        let added = simple.map(|h| AddedEffect {
            candidate: &self.candidates[h.candidate],
            index: h.candidate,
            unit: h.score.amplitude.abs().max(f64::MIN_POSITIVE),
        });
        added.collect()
    }
}
