//! The second pass of the search: the candidates are scored again at the best variant, then replacements and pairs are refitted.
//!
//! Next files to read: [`crate::judge::form`], then [`crate::judge::verdict`].

use starlings_estimators::Optimum;
use starlings_study::{Record, Study};

use super::modulated_forms::{constants, modulated_forms};
use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::contribution::{DISCREPANT, check_contributions, settles};
use crate::judge::effective_noise::inflation;
use crate::judge::form::{Leftover, Measured, leftover};
use crate::judge::gates::JudgedFit;
use crate::judge::objections::SHARE;
use crate::judge::search_result::SearchResult;
use crate::options::Options;
use crate::run_cache::Course;
use crate::screen::screening::screen;
use crate::screen::screening_result::ScreeningResult;

/// Further effects that are looked at beside the best variant.
const MOST: usize = 2;

/// A further effect beside the best variant.
struct Second {
    result: ScreeningResult,
    /// Whether it counts only if it settles what its partner leaves.
    must_settle: bool,
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Scores the candidates again at the best variant and refits replacements and pairs, until no better variant comes of it.
    /// In the end the form of the variant that the verdict will be about has been measured.
    pub(super) fn second_pass(
        &mut self,
        found: &mut SearchResult<'c>,
        options: &Options,
    ) -> Result<(), ExplainError> {
        for pass in 1..=options.max_effects {
            if found.judged.first().is_none_or(|j| j.refusal.is_some()) {
                return Ok(());
            }
            let course = if pass < options.max_effects { Course::Again } else { Course::Last };
            let screening = self.rescreen(found, 0, course)?;
            let best = &found.judged[0];
            let name = best.fit.variant.name();
            let mut seconds = self.seconds(best, &screening, found.null_distribution.threshold)?;
            if seconds.is_empty() && self.is_open(found)? {
                seconds = self.hidden_seconds(&screening, found.null_distribution.threshold);
            }
            if seconds.is_empty() {
                break;
            }
            let (fits, to_settle) = self.replacements_and_pairs(found, best, &seconds, options)?;
            let n = fits.len();
            self.judge_all(found, fits)?;
            drop_unsettled(found, &name, &to_settle);
            let same = found.judged.first().is_some_and(|j| j.fit.variant.name() == name);
            if n == 0 || same {
                break;
            }
        }
        let passing = found.passing();
        if let Some(chosen) = (!passing.is_empty()).then(|| check_contributions(found, &passing).checked)
            && found.judged[chosen].leftover.is_none()
        {
            self.rescreen(found, chosen, Course::Last)?;
        }
        Ok(())
    }

    /// The two best further effects that gain more than chance.
    fn seconds(
        &self,
        partner: &JudgedFit<'c>,
        screening: &[ScreeningResult],
        threshold: f64,
    ) -> Result<Vec<Second>, ExplainError> {
        let optimum = partner.fit.optimum()?;
        let mut seconds = Vec::new();
        for result in self.best_of_each(screening) {
            let must_settle = result.score.gain <= partner.inflation * threshold;
            if !must_settle || self.may_settle(partner, &optimum, &result, threshold)? {
                seconds.push(Second { result, must_settle });
            }
            if seconds.len() == MOST {
                break;
            }
        }
        Ok(seconds)
    }

    /// The two best further effects where nothing is named: those that gain more than chance in white noise may be what makes the residuals no
    /// noise, and to first order a small part of it where their terms bend. They count only if they settle it.
    fn hidden_seconds(&self, screening: &[ScreeningResult], threshold: f64) -> Vec<Second> {
        let best = self.best_of_each(screening).into_iter().filter(|result| result.score.gain > threshold);
        best.take(MOST).map(|result| Second { result, must_settle: true }).collect()
    }

    /// Whether a further effect takes most of what its partner leaves, a discrepancy of its own, and gains more than chance in units of the
    /// noise that both leave.
    fn may_settle(
        &self,
        partner: &JudgedFit<'c>,
        optimum: &Optimum,
        second: &ScreeningResult,
        threshold: f64,
    ) -> Result<bool, ExplainError> {
        let (gain, n) = (second.score.gain, self.cache.rows.train.len());
        let excess = partner.fit.residual().norm_squared() - n as f64;
        if partner.inflation <= DISCREPANT || excess <= 0.0 || gain < SHARE * excess {
            return Ok(false);
        }
        let own = optimum.unimitated(&second.influence.of_train(self.cache)?);
        let left = optimum.residual() - own * second.score.amplitude;
        Ok(gain > threshold * inflation(&self.cache.rows, &left.rows(0, n).into_owned()))
    }

    /// Scores the candidates at the refitted variant at a position, and notes the fall of χ² that they and modulated forms of its
    /// effects would still bring.
    fn rescreen(
        &mut self,
        found: &mut SearchResult<'c>,
        place: usize,
        course: fn(usize) -> Course,
    ) -> Result<Vec<ScreeningResult>, ExplainError> {
        let judged = &found.judged[place];
        let points = self.best_points(&found.screening);
        let forms = modulated_forms(judged, self.tracks, span(self.cache.study));
        let constants = constants(judged);
        self.cache.foreseen.goes(course(points.len() + forms.len() + constants.len()));
        self.cache.stage("screen", &format!("again, with {}", judged.fit.variant.name()));
        let screening = self.screen(&judged.fit, &points)?;
        let left = self.measure_leftover(judged, &screening, [forms, constants])?;
        let variant = |j: &JudgedFit<'_>| (j.fit.variant.name(), j.fit.variant.left_out.clone());
        let of_place = variant(judged);
        if let Some(first) = found.judged.iter_mut().find(|j| variant(j) == of_place) {
            first.leftover = Some(left);
        }
        Ok(screening)
    }

    /// The fall of χ² that the candidates and the modulated forms of the best would still bring.
    fn measure_leftover(
        &mut self,
        best: &JudgedFit<'c>,
        library: &[ScreeningResult],
        [forms, constants]: [Vec<Candidate>; 2],
    ) -> Result<Leftover, ExplainError> {
        let (modulated, constants) = (self.measure(best, forms)?, self.measure(best, constants)?);
        let measured = Measured { library, modulated: &modulated, constants: &constants };
        leftover(self.cache, &best.fit, &measured)
    }

    /// Screens effects that are not candidates, if the budget suffices.
    fn measure(
        &mut self,
        best: &JudgedFit<'c>,
        mut forms: Vec<Candidate>,
    ) -> Result<Vec<ScreeningResult>, ExplainError> {
        // Not every modulated form builds: a state of its own may not read all that the term reads.
        forms.retain(|form| {
            let mut effects: Vec<AddedEffect<'_>> = best.fit.variant.effects.clone();
            effects.push(AddedEffect { candidate: form, index: 0, unit: 1.0 });
            ModelVariant::new(best.fit.variant.base, effects, &best.fit.variant.left_out).is_ok()
        });
        let of: Vec<(usize, usize)> = (0..forms.len()).map(|i| (i, 0)).collect();
        if !self.cache.affords(of.len()) {
            return Ok(Vec::new());
        }
        screen(self.cache, &best.fit, &forms, &of, self.tracks)
    }

    /// Refits replacements (a second effect alone, where it was not refitted yet) and pairs. With them come the candidates of those pairs
    /// that count only if they settle what the best leaves.
    fn replacements_and_pairs(
        &mut self,
        found: &SearchResult<'c>,
        best: &JudgedFit<'c>,
        seconds: &[Second],
        options: &Options,
    ) -> Result<(Vec<FittedVariant<'c>>, Vec<Vec<usize>>), ExplainError> {
        let tried = |indices: &[usize]| found.judged.iter().any(|j| j.fit.variant.has_just(indices));
        let (mut fits, mut to_settle) = (Vec::new(), Vec::new());
        for Second { result: second, must_settle } in seconds {
            if !must_settle
                && !tried(&[second.candidate])
                && let Some(alone) =
                    self.best_of_each(&found.screening).iter().find(|h| h.candidate == second.candidate)
            {
                fits.push(self.with_candidate(&found.base, alone)?);
            }
            let mut pair: Vec<usize> = best.fit.variant.effects.iter().map(|m| m.index).collect();
            pair.push(second.candidate);
            if pair.len() <= options.max_effects && !tried(&pair) {
                fits.push(self.with_candidate(&best.fit, second)?);
                if *must_settle {
                    to_settle.push(pair);
                }
            }
        }
        self.cache.foreseen.goes(Course::Beside(fits.len()));
        self.cache.stage("refit", &format!("{} replacements and pairs", fits.len()));
        Ok((self.refit(fits)?, to_settle))
    }

    /// The best point of the grid of every candidate, by the first screening; and those at which the residuals jump, since beside another effect
    /// that may be what is left.
    pub(super) fn best_points(&self, screening: &[ScreeningResult]) -> Vec<(usize, usize)> {
        let best = self.best_of_each(screening);
        let point = |result: &ScreeningResult| {
            let points = &self.candidates[result.candidate].points;
            points.iter().position(|p| *p == result.point).map(|p| (result.candidate, p))
        };
        let mut of: Vec<(usize, usize)> = best.iter().filter_map(point).collect();
        for c in 0..self.candidates.len() {
            let sound = screening.iter().any(|h| h.candidate == c && h.failure.is_none());
            let jumps = self.candidates[c].jumps.iter().map(|jump| (c, *jump));
            let jumps: Vec<(usize, usize)> = jumps.filter(|jump| sound && !of.contains(jump)).collect();
            of.extend(jumps);
            if sound && !of.iter().any(|(known, _)| *known == c) {
                of.push((c, 0));
            }
        }
        of
    }
}

/// Leaves out those of these pairs, by their candidates, that do not settle what their partner, of this name, leaves.
fn drop_unsettled(found: &mut SearchResult<'_>, partner: &str, pairs: &[Vec<usize>]) {
    let Some(part) = found.judged.iter().find(|j| j.fit.variant.name() == partner) else { return };
    let is_dropped = |judged: &JudgedFit<'_>| {
        pairs.iter().any(|pair| judged.fit.variant.has_just(pair)) && !settles(judged, part)
    };
    let dropped: Vec<bool> = found.judged.iter().map(is_dropped).collect();
    let mut dropped = dropped.into_iter();
    found.judged.retain(|_| dropped.next() == Some(false));
}

/// First and last training time of a study.
fn span(study: &Study) -> [f64; 2] {
    let spans = || study.records.iter().filter_map(Record::train_span);
    let from = spans().map(|s| s[0]).fold(f64::INFINITY, f64::min);
    [from, spans().map(|s| s[1]).fold(f64::NEG_INFINITY, f64::max)]
}
