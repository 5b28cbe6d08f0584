//! Effects whose amplitude does not enter their terms in proportion, at finite amplitudes.
//!
//! The slope of a delay or an exponent at zero says little of what it does where it matters, and may have the wrong sign. Such an
//! effect is therefore held at amplitudes spread over its range; the parameters are fitted there, and the other candidates scored
//! beside it. What promises most is refitted with the amplitude free. Next file to read: [`super::pairs`].

use std::collections::HashSet;

use starlings_models::EffectDef;
use starlings_models::equations::Expression;

use super::pairs::hold_own;
use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::drive::drive_rounds;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::search_result::SearchResult;
use crate::screen::screening_result::ScreeningResult;

/// Amplitudes at which such an effect is held, as shares of its range.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 0.75];
/// Rounds of runs of the fits there.
const ROUNDS: usize = 12;
/// Precision of an amplitude that is held.
const HELD: f64 = 1e12;
/// Partners of an effect that are refitted with it.
const PARTNERS: usize = 3;

/// A partner beside an effect that is held: the position of the fit there, the score, χ² plus prior with both to first order.
struct Beside {
    fit: usize,
    partner: ScreeningResult,
    cost: f64,
}

/// Whether the terms of an effect depend on its amplitude in another way than in proportion, within a range of two ends.
fn is_nonlinear(def: &EffectDef) -> bool {
    let Some(amplitude) = def.parameters.first() else { return false };
    let is_linear = |term: &str| Expression::parse(term).is_ok_and(|e| e.is_linear_in(&amplitude.name));
    amplitude.range.iter().all(|end| end.is_finite()) && !def.adds.iter().all(|add| is_linear(&add.term))
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Fits of such effects at the model as it is, alone and with the partners that promise most, which promise a cost below
    /// `wanted`.
    pub(super) fn finite_fits(
        &mut self,
        found: &SearchResult<'c>,
        wanted: f64,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let of: Vec<(usize, usize)> = self.best_points(&found.screening);
        let mut begun = Vec::new();
        for (index, candidate) in self.candidates.iter().enumerate().filter(|(_, c)| is_nonlinear(&c.def)) {
            let mut fits = held(&found.base, candidate, index);
            hold_own(&mut fits);
            self.cut_short |= !drive_rounds(self.cache, &mut fits, ROUNDS)?;
            // Far from where the model was fitted the data may leave a direction free; nothing can be scored there.
            let is_known =
                |fit: &FittedVariant<'_>| !fit.residual().is_empty() && !fit.jacobian.of_train.is_empty();
            fits.retain(|fit| is_known(fit) && fit.optimum().is_ok());
            let mut beside = self.beside(&fits, &of)?;
            beside.retain(|b| b.cost < wanted);
            for Beside { fit, partner, .. } in beside.iter().take(PARTNERS) {
                begun.extend(self.with_candidate(&fits[*fit], partner).ok());
            }
            let alone = fits.iter().min_by(|a, b| a.cost().total_cmp(&b.cost()));
            begun.extend(alone.filter(|fit| fit.cost() < wanted).and_then(free));
        }
        Ok(begun)
    }

    /// Every partner beside the one of these fits with which it promises most, those that promise most first.
    fn beside(
        &mut self,
        fits: &[FittedVariant<'c>],
        of: &[(usize, usize)],
    ) -> Result<Vec<Beside>, ExplainError> {
        let mut all = Vec::new();
        for (at, fit) in fits.iter().enumerate() {
            for partner in self.screen(fit, of)? {
                let gain = partner.allowed_gain(self.candidates[partner.candidate].sign());
                if gain > 0.0 && partner.failure.is_none() && !partner.is_imitated() {
                    all.push(Beside { fit: at, partner, cost: fit.cost() - gain });
                }
            }
        }
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut seen = HashSet::new();
        all.retain(|b| seen.insert(b.partner.candidate));
        Ok(all)
    }
}

/// Fits of the model with an effect that is held at one amplitude each.
fn held<'c>(base: &FittedVariant<'c>, candidate: &'c Candidate, index: usize) -> Vec<FittedVariant<'c>> {
    let [lo, hi] = candidate.def.parameters[0].range;
    let amplitudes = SHARES.into_iter().map(|share| lo + share * (hi - lo)).filter(|a| a.abs() > 0.0);
    let fit = |amplitude: f64| {
        let added = AddedEffect { candidate, index, unit: amplitude.abs() };
        let effects = base.variant.effects.iter().cloned().chain([added]).collect();
        // Two effects that share a name cannot be in one model.
        let mut variant = ModelVariant::new(base.variant.base, effects, &base.variant.left_out).ok()?;
        let mut start = variant.continue_from(&base.variant, base.z(), &candidate.points[0]);
        let entry = variant.first_entry_of(variant.effects.len() - 1);
        start[entry] = amplitude.signum();
        (variant.scaled.mean[entry], variant.scaled.precision[entry]) = (start[entry], HELD);
        Some(FittedVariant::begin(variant, start))
    };
    amplitudes.filter_map(fit).collect()
}

/// The same fit with its last effect's amplitude free.
fn free<'c>(fit: &FittedVariant<'c>) -> Option<FittedVariant<'c>> {
    let of = &fit.variant;
    let variant = ModelVariant::new(of.base, of.effects.clone(), &of.left_out).ok()?;
    Some(FittedVariant::begin(variant, fit.z().clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models::effect::{Addition, EffectParameter};

    fn effect(term: &str, range: [f64; 2]) -> EffectDef {
        let amplitude = EffectParameter { name: "a".to_owned(), range, ..EffectParameter::default() };
        let adds = vec![Addition { to: "y".to_owned(), term: term.to_owned() }];
        EffectDef { name: "e".to_owned(), adds, parameters: vec![amplitude], ..EffectDef::default() }
    }

    #[test]
    fn a_delay_of_bounded_range_is_nonlinear_and_a_gain_is_not() {
        assert!(is_nonlinear(&effect("delay(u, a) - u", [0.0, 0.3])));
        assert!(is_nonlinear(&effect("u^a - u", [0.0, 2.0])));
        assert!(!is_nonlinear(&effect("-a*x*abs(x)/m", [0.0, 1.0])));
        assert!(!is_nonlinear(&effect("delay(u, a) - u", [0.0, f64::INFINITY])), "no range to spread over");
    }
}
