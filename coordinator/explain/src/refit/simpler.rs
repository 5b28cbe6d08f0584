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
        let of = &pair.variant;
        let elaborate = [(a, b), (b, a)].into_iter().filter(|(_, goes)| goes.candidate.n_inner() > 0);
        let pairs = elaborate.flat_map(|(stays, goes)| {
            self.simple_in_place_of(found, goes).into_iter().map(move |new| [stays.clone(), new])
        });
        let is_new = |[stays, new]: &[AddedEffect<'c>; 2]| {
            let known = found.judged.iter().any(|j| j.fit.variant.has_just(&[stays.index, new.index]));
            stays.index != new.index && !known
        };
        // Two effects that share a name cannot be in one model.
        let variants = pairs
            .filter(is_new)
            .filter_map(|pair| ModelVariant::new(of.base, pair.to_vec(), &of.left_out).ok());
        let begin = |variant: ModelVariant<'c>| {
            let start = variant.continue_from(of, pair.z(), &[]);
            FittedVariant::begin(variant, start)
        };
        let begun: Vec<_> = variants.map(begin).collect();
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
