//! Pairs of effects that show only together: scored to first order from what the screening measured, the best refitted.
//!
//! Neither of two effects may gain more than chance alone, or pass the gates, and the pair explain the gap: friction that the fitted
//! damping imitates beside a damping of another power, a delay beside the resistance that it hides. The scores of all pairs follow
//! from the influences at the fit, without a run. Next file to read: [`super::second_pass`].

use nalgebra::{DMatrix, DVector};

use super::ranking::largest_of_each;
use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::drive::drive_rounds;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::contribution::SECOND_SHARE;
use crate::judge::effective_noise::inflation;
use crate::judge::search_result::SearchResult;
use crate::judge::twins::ALIKE;
use crate::run_cache::Course;
use crate::screen::screening_result::ScreeningResult;

/// Pairs that begin a refit.
const PAIRS: usize = 10;
/// Rounds of runs after which those that promise most go on ...
const ROUNDS: usize = 12;
/// ... so many of those by their scores, and so many of those at finite amplitudes.
const FINAL: usize = 3;
/// Part of the way to the amplitudes that the scores promise at which a refit begins: as far as the influences surely hold.
const FIRST_WAY: f64 = 0.1;

/// Prior standard deviations within which the model's own parameters stay beside two effects, unless they were further already: beyond, two
/// terms that nearly cancel run away together, and a run takes its million steps.
const FARTHEST: f64 = 8.0;

/// One effect as a member of a pair.
struct Member {
    result: ScreeningResult,
    sign: f64,
    /// What the parameters cannot imitate.
    own: DVector<f64>,
}

impl Member {
    /// Whether another has the same influence, with an amplitude of an allowed sign.
    fn is_alike(&self, other: &Self) -> bool {
        let along = self.own.dot(&other.own);
        let signs = self.sign * other.sign;
        along.abs() > ALIKE * self.own.norm() * other.own.norm() && signs * along >= 0.0
    }
}

/// A pair with the amplitudes of both and the fall of χ² to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PairScore {
    members: [usize; 2],
    amplitudes: [f64; 2],
    gain: f64,
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Refits the best pairs at the model as it is, where nothing else explains the gap.
    pub(super) fn refit_pairs(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        self.cache.foreseen.goes(Course::Open);
        let members = self.members(found)?;
        let optimum = found.base.optimum()?;
        let threshold = found.null_distribution.threshold;
        let mut fits: Vec<FittedVariant<'c>> = Vec::new();
        // What was asked for by name is tried together, however little it adds to first order.
        let share = if self.asked { 0.0 } else { SECOND_SHARE };
        for pair in best_pairs(&members, optimum.residual(), share) {
            // The noise is that of the residuals without the pair.
            let [a, b] = pair.members.map(|m| &members[m]);
            let taken = &a.own * pair.amplitudes[0] + &b.own * pair.amplitudes[1];
            let left = optimum.residual() - taken;
            let noise = inflation(&self.cache.rows, &left.rows(0, self.cache.rows.train.len()).into_owned());
            if pair.gain > noise * threshold
                && !found.judged.iter().any(|j| j.fit.variant.has_just(&[a, b].map(|of| of.result.candidate)))
                // Two effects that share a name cannot be in one model.
                && let Ok(fit) = self.with_pair(&found.base, [a, b], pair.amplitudes)
            {
                fits.push(fit);
            }
        }
        let finite = self.finite_or_none(found, threshold)?;
        let n = fits.len() + finite.len();
        self.cache.stage("refit", &format!("{n} pairs, since no effect explains the gap alone"));
        let mut first = self.first_of(fits)?;
        first.extend(self.first_of(finite)?);
        if first.is_empty() {
            return Ok(());
        }
        let mut fits = self.refit(first)?;
        fits.extend(self.members_alone(found, &fits)?);
        let fits = self.none_above_its_parts(found, fits)?;
        self.judge_all(found, fits)
    }

    /// Fits at finite amplitudes, which no term without a name of its own needs.
    fn finite_or_none(
        &mut self,
        found: &SearchResult<'c>,
        threshold: f64,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        if self.tried.contains(&Kind::Generic) && !self.asked {
            return Ok(Vec::new());
        }
        self.cache.stage("screen", "effects at finite amplitudes, since no effect explains the gap alone");
        self.finite_fits(found, found.base.cost() - threshold)
    }

    /// Those of these fits that promise most after their first rounds. Without a run, for it failed or the budget ended before it, there
    /// is nothing to judge.
    pub(super) fn first_of(
        &mut self,
        mut fits: Vec<FittedVariant<'c>>,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        hold_own(&mut fits);
        self.cut_short |= !drive_rounds(self.cache, &mut fits, ROUNDS)?;
        fits.retain(|fit| !fit.residual().is_empty());
        fits.sort_by(|a, b| a.promised().total_cmp(&b.promised()));
        fits.truncate(FINAL);
        Ok(fits)
    }

    /// A fit that adds two effects to a fitted variant and begins on the way to the amplitudes that their scores promise, with the
    /// parameters where these move them, to first order. It does not begin at zero, where an amplitude is held at the end of its range
    /// as long as its partner is absent.
    fn with_pair(
        &self,
        parent: &FittedVariant<'c>,
        members: [&Member; 2],
        amplitudes: [f64; 2],
    ) -> Result<FittedVariant<'c>, ExplainError> {
        let optimum = parent.optimum()?;
        let mut moved = parent.z().clone();
        let (mut effects, mut inner) = (parent.variant.effects.clone(), Vec::new());
        for (member, amplitude) in members.iter().zip(amplitudes) {
            let result = &member.result;
            moved -= optimum.response(&result.influence.of_train(self.cache)?) * (FIRST_WAY * amplitude);
            inner.extend_from_slice(&result.point);
            let (candidate, unit) =
                (&self.candidates[result.candidate], amplitude.abs().max(f64::MIN_POSITIVE));
            effects.push(AddedEffect { candidate, index: result.candidate, unit });
        }
        let first = effects.len() - 2;
        let variant = ModelVariant::new(parent.variant.base, effects, &parent.variant.left_out)?;
        let mut start = variant.continue_from(&parent.variant, &moved, &inner);
        for (k, amplitude) in amplitudes.iter().enumerate() {
            start[variant.first_entry_of(first + k)] = FIRST_WAY * amplitude.signum();
        }
        Ok(FittedVariant::begin(variant, start))
    }

    /// What each candidate does at the model as it is, at the best point of its grid. As many as the memory holds, those that gain
    /// most first; of those that do the same the likeliest before any data. An instrument's error, which can imitate almost anything, is
    /// none beside a variant that passes the gates.
    fn members(&mut self, found: &SearchResult<'c>) -> Result<Vec<Member>, ExplainError> {
        let optimum = found.base.optimum()?;
        let kind = |h: &ScreeningResult| self.candidates[h.candidate].kind;
        let all = found.passing().is_empty();
        let is_tried = |kind: Kind| self.tried.contains(&kind) && (all || kind != Kind::Instrument);
        let is_usable = |h: &&ScreeningResult| h.failure.is_none() && !h.is_imitated() && is_tried(kind(h));
        let usable = found.screening.iter().filter(is_usable);
        let mut best = largest_of_each(usable, |h| h.score.gain);
        best.truncate(self.cache.series_held().max(2));
        let mut members: Vec<Member> = Vec::with_capacity(best.len());
        for result in best {
            let own = optimum.unimitated(&result.influence.of_train(self.cache)?);
            let candidate = &self.candidates[result.candidate];
            let (kind, new) = (candidate.kind, Member { sign: candidate.sign(), result, own });
            match members.iter_mut().find(|known| known.is_alike(&new)) {
                Some(known) if kind < self.candidates[known.result.candidate].kind => *known = new,
                Some(_) => {}
                None => members.push(new),
            }
        }
        Ok(members)
    }
}

/// Keeps the model's own parameters where they may be in these fits.
pub(super) fn hold_own(fits: &mut [FittedVariant<'_>]) {
    for fit in fits {
        fit.solver.hold(fit.variant.n_own, FARTHEST);
    }
}

/// The pairs with the largest gain, each of whose members adds its share, one for every two candidates.
fn best_pairs(members: &[Member], residual: &DVector<f64>, share: f64) -> Vec<PairScore> {
    let k = members.len();
    let along = DVector::from_iterator(k, members.iter().map(|m| m.own.dot(residual)));
    let products =
        DMatrix::from_fn(k, k, |i, j| if i <= j { members[i].own.dot(&members[j].own) } else { 0.0 });
    let mut pairs: Vec<PairScore> = Vec::new();
    for j in 0..k {
        for i in 0..j {
            let [a, b] = [&members[i], &members[j]];
            let of = Normal {
                along: [along[i], along[j]],
                squares: [products[(i, i)], products[(j, j)]],
                both: products[(i, j)],
            };
            if a.result.candidate != b.result.candidate
                && let Some((amplitudes, gain)) = of.best([a.sign, b.sign], share)
            {
                pairs.push(PairScore { members: [i, j], amplitudes, gain });
            }
        }
    }
    pairs.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let candidates = |p: &PairScore| p.members.map(|m| members[m].result.candidate);
    let mut kept: Vec<PairScore> = Vec::new();
    for pair in pairs {
        let [a, b] = candidates(&pair);
        if kept.len() < PAIRS && !kept.iter().any(|p| candidates(p) == [a, b] || candidates(p) == [b, a]) {
            kept.push(pair);
        }
    }
    kept
}

/// The normal equations of two influences.
struct Normal {
    along: [f64; 2],
    squares: [f64; 2],
    both: f64,
}

impl Normal {
    /// The fall of χ² at these amplitudes.
    fn gain(&self, [a, b]: [f64; 2]) -> f64 {
        2.0 * (a * self.along[0] + b * self.along[1])
            - a * a * self.squares[0]
            - b * b * self.squares[1]
            - 2.0 * a * b * self.both
    }

    /// The best amplitudes and their gain; `None` where a sign is not allowed, or one of the two does not add its share.
    fn best(&self, signs: [f64; 2], share: f64) -> Option<([f64; 2], f64)> {
        let [n0, n1] = self.squares;
        let alike = self.both.abs() > ALIKE * (n0 * n1).sqrt();
        if alike || !(n0 > 0.0 && n1 > 0.0) {
            return None;
        }
        let determinant = n0 * n1 - self.both * self.both;
        let amplitudes = [
            (n1 * self.along[0] - self.both * self.along[1]) / determinant,
            (n0 * self.along[1] - self.both * self.along[0]) / determinant,
        ];
        let alone = |k: usize| {
            let amplitude = self.along[k] / self.squares[k];
            let at = if k == 0 { [amplitude, 0.0] } else { [0.0, amplitude] };
            if amplitude * signs[k] >= 0.0 { self.gain(at).max(0.0) } else { 0.0 }
        };
        let gain = self.gain(amplitudes);
        let allowed = (0..2).all(|k| amplitudes[k] * signs[k] >= 0.0);
        (allowed && gain.is_finite() && gain - alone(0).max(alone(1)) > share * gain)
            .then_some((amplitudes, gain))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two influences of length one with this product, and a residual made of amplitudes of both.
    fn normal(both: f64, [a, b]: [f64; 2]) -> Normal {
        Normal { along: [a + both * b, b + both * a], squares: [1.0, 1.0], both }
    }

    #[test]
    fn two_effects_that_hide_each_other_are_found_with_both_amplitudes() {
        // Alone neither shows: along the first the residual is 10 - 0.9 · 10 = 1.
        let ([a, b], gain) = normal(-0.9, [10.0, 10.0]).best([1.0, 1.0], SECOND_SHARE).unwrap();
        // Exact up to rounding: the fall of χ² is the square of the residual, 100 + 100 - 2 · 0.9 · 100.
        assert!(
            (a - 10.0).abs() < 1e-9 && (b - 10.0).abs() < 1e-9 && (gain - 20.0).abs() < 1e-9,
            "{a} {b} {gain}"
        );
    }

    #[test]
    fn a_pair_of_the_wrong_sign_or_with_a_member_that_adds_nothing_is_none() {
        assert!(
            normal(-0.5, [10.0, -10.0]).best([1.0, 1.0], SECOND_SHARE).is_none(),
            "the second would be negative"
        );
        assert!(
            normal(-0.5, [10.0, -10.0]).best([1.0, 0.0], SECOND_SHARE).is_some(),
            "either sign is allowed"
        );
        assert!(normal(0.0, [10.0, 0.5]).best([1.0, 1.0], SECOND_SHARE).is_none(), "the second adds 0.2 %");
        assert!(normal(0.999, [10.0, 10.0]).best([1.0, 1.0], SECOND_SHARE).is_none(), "both are one");
    }
}
