//! Replacements of terms that the study would give up: what does most of the work of a term that is left out.
//!
//! The model without the term may be far from the data, so that nothing can be scored there. It is scored at the model as it is, from the
//! influence of the term itself: to first order a candidate replaces it with the amplitude, and the parameters with the shifts, that
//! make up for what goes. The refits begin there. Next file to read: [`super::second_pass`].

use nalgebra::DVector;
use starlings_estimators::Optimum;
use starlings_models::EffectDef;
use starlings_models::effect::{Addition, EffectParameter};
use starlings_models::equations::EquationsDef;

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::search_result::SearchResult;
use crate::screen::screening::screen;
use crate::screen::screening_result::ScreeningResult;

/// Candidates that begin a refit in the place of one term.
const PLACES: usize = 3;
/// Longest shift of a parameter at which a refit begins, in prior standard deviations.
const LONGEST: f64 = 3.0;

/// The model as it is without a term, to first order.
struct Gap<'c> {
    variant: ModelVariant<'c>,
    optimum: Optimum,
    /// What leaving the term out changes in the training rows.
    influence: DVector<f64>,
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Leaves out every replaceable term in turn and refits what does most of its work. Those that still promise to fit worse than the
    /// model as it is, after the first rounds, could pass no gate and are left.
    pub(super) fn replace_terms(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        let Some(equations) = self.cache.study.setup.model.equations.clone() else { return Ok(()) };
        for term in &equations.replaceable {
            self.cache.stage("screen", &format!("without {term}, which may be replaced"));
            let Some(gap) = self.gap(&found.base, &equations, term)? else { continue };
            let begun = self.in_place(found, &gap)?;
            self.cache.stage("refit", &format!("{} effects in place of {term}", begun.len()));
            let mut fits = self.first_of(begun)?;
            fits.retain(|fit| fit.promised() < found.base.cost());
            if !fits.is_empty() {
                let fits = self.refit(fits)?;
                self.judge_all(found, fits)?;
            }
        }
        Ok(())
    }

    /// Measures what a term does at a fit; nothing where it does nothing, or the budget does not suffice.
    fn gap(
        &mut self,
        base: &FittedVariant<'c>,
        equations: &EquationsDef,
        term: &str,
    ) -> Result<Option<Gap<'c>>, ExplainError> {
        if !self.cache.affords(1) {
            self.cut_short = true;
            return Ok(None);
        }
        let removal = [Candidate::new(removal(equations, term))];
        let measured = screen(self.cache, base, &removal, &[(0, 0)], self.tracks)?;
        let Some(result) = measured.first().filter(|result| result.failure.is_none()) else {
            return Ok(None);
        };
        let influence = result.influence.of_train(self.cache)?;
        let variant = ModelVariant::new(base.variant.base, Vec::new(), &[term.to_owned()])?;
        let from = |j: usize| {
            let name = &variant.study.theta[j].name;
            base.variant.study.theta.iter().position(|entry| entry.name == *name).map(|i| (i, 1.0))
        };
        let jacobian = base.jacobian.of_train.map_columns(variant.n_param(), from);
        let pull = &variant.scaled.mean - variant.continue_from(&base.variant, base.z(), &[]);
        let residual = base.residual() - &influence;
        let optimum = Optimum::in_blocks(&residual, &jacobian, &variant.scaled.precision, &pull)?;
        Ok(Some(Gap { variant, optimum, influence }))
    }

    /// Fits that begin with the candidates that do most of what a term did.
    fn in_place(
        &mut self,
        found: &SearchResult<'c>,
        gap: &Gap<'c>,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let mut scored: Vec<ScreeningResult> = Vec::with_capacity(found.screening.len());
        for result in found.screening.iter().filter(|result| result.failure.is_none()) {
            let score = gap.optimum.score(&result.influence.of_train(self.cache)?);
            scored.push(ScreeningResult { score, is_significant: true, ..result.clone() });
        }
        let best = self.best_of_each(&scored);
        best.iter().take(PLACES).map(|result| self.begin_in_place(&found.base, gap, result)).collect()
    }

    /// A fit with a candidate where the term was, from where it makes up for it to first order.
    fn begin_in_place(
        &self,
        base: &FittedVariant<'c>,
        gap: &Gap<'c>,
        result: &ScreeningResult,
    ) -> Result<FittedVariant<'c>, ExplainError> {
        let amplitude = result.score.amplitude;
        let (candidate, index) = (&self.candidates[result.candidate], result.candidate);
        let added = AddedEffect { candidate, index, unit: amplitude.abs().max(f64::MIN_POSITIVE) };
        let variant = ModelVariant::new(base.variant.base, vec![added], &gap.variant.left_out)?;
        let change = &gap.influence + result.influence.of_train(self.cache)? * amplitude;
        let shift = gap.optimum.response(&change).map(|v| v.clamp(-LONGEST, LONGEST));
        let moved = gap.variant.continue_from(&base.variant, base.z(), &[]) - shift;
        let mut start = variant.continue_from(&gap.variant, &moved, &result.point);
        start[variant.first_entry_of(0)] = amplitude.signum();
        Ok(FittedVariant::begin(variant, start))
    }
}

/// The effect that takes a term away, wherever it occurs; at amplitude one nothing of it is left.
fn removal(equations: &EquationsDef, term: &str) -> EffectDef {
    let letters = |c: char| if c.is_alphanumeric() { c } else { '_' };
    let name: String = format!("without_{term}").chars().map(letters).collect();
    let rates = equations.states.iter().flat_map(|state| state.rate.iter().map(move |rate| (state, rate)));
    let of_term = rates.filter(|(_, (known, _))| known == term);
    let adds = of_term
        .map(|(state, (_, text))| Addition { to: state.name.clone(), term: format!("-{name}*({text})") });
    EffectDef {
        name: format!("without {term}"),
        adds: adds.collect(),
        parameters: vec![EffectParameter { name, range: [0.0, 1.0], ..EffectParameter::default() }],
        ..EffectDef::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::equations::StateDef;

    #[test]
    fn a_term_is_taken_away_from_every_rate_that_has_it() {
        let state = |name: &str, rate: &[(&str, &str)]| StateDef {
            name: name.to_owned(),
            rate: rate.iter().map(|(term, text)| ((*term).to_owned(), (*text).to_owned())).collect(),
            ..StateDef::default()
        };
        let states = vec![
            state("x", &[("flow", "v")]),
            state("v", &[("spring", "-k*x"), ("air drag", "-c*v")]),
            state("w", &[("air drag", "-c*w + d")]),
        ];
        let def = removal(&EquationsDef { states, ..EquationsDef::default() }, "air drag");
        let adds: Vec<[&str; 2]> = def.adds.iter().map(|add| [add.to.as_str(), add.term.as_str()]).collect();
        assert_eq!(adds, [["v", "-without_air_drag*(-c*v)"], ["w", "-without_air_drag*(-c*w + d)"]]);
    }
}
