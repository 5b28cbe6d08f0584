//! How probable each set of effects is, and that none of them is what is missing.
//!
//! What the data say of the sets among each other is their support in units of the effective noise, so that correlated residuals count as
//! the few values that they are worth. What they say of causes outside of the list is the verdict itself: how often it falls where the
//! truth is in no list, over how often where it is, was counted where the answer is known. Next file to read: [`super::verdict`].

use serde::{Deserialize, Serialize};

use super::adequacy::Adequacy;
use super::gates::JudgedFit;
use super::larger_noise::larger;
use super::search_result::SearchResult;
use super::verdict::{Decision, Verdict};
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::number::percent;
use crate::rows::Rows;

/// Probability, before any data, that what is missing is in no list.
const UNLISTED: f64 = 0.1;
/// How often one name falls where the truth is in no list, over how often where it is ...
const NAMED: f64 = 0.21;
/// ... the same of two names together, where one listed truth in four has two effects ...
const PAIRED: f64 = 0.6;
/// ... of a proposal that is told first, where a truth that nobody listed has as often a form that is proposed as another one ...
const PROPOSED: f64 = 1.8;
/// ... the same of a tie ...
const TIED: f64 = 0.5;
/// ... and of `unexplained`.
const UNEXPLAINED: f64 = 45.0;
/// The same at least of a name or a tie whose residuals are too few to be tested for correlation: what is not in the list would pass as well.
const UNTESTED: f64 = 1.0;
/// Sets and their probabilities that are told in words.
const TOLD: usize = 4;
/// Probability below which a set is not spoken of.
const SPOKEN: f64 = 0.005;

/// How probable each answer is where there is a gap; all of them sum to one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Probabilities {
    /// The sets of effects, the most probable first.
    pub sets: Vec<ProbableSet>,
    /// Nothing is missing.
    pub nothing_missing: f64,
    /// Something is missing that is in no list.
    pub none_of_these: f64,
    /// Share of the gap, above the noise, that is left with what was named or came nearest.
    pub discrepancy: f64,
}

/// A set of effects with its probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProbableSet {
    /// Names of the effects.
    pub names: Vec<String>,
    /// Terms of the model that they replace.
    pub replaced: Vec<String>,
    /// The probability.
    pub probability: f64,
}

impl Probabilities {
    /// Where noise cannot be what the model leaves, something is missing: what no set accounts for is in no list.
    fn with_gap(mut self, is_gap: bool) -> Self {
        if is_gap {
            self.none_of_these += std::mem::take(&mut self.nothing_missing);
        }
        self
    }

    /// Where noise that is correlated and larger than was found could be all that the model leaves, which no count speaks of: that nothing is missing
    /// is then as probable as that something is which was not tried.
    fn with_noise(mut self, could_be_noise: bool) -> Self {
        if could_be_noise {
            let each = 0.5 * (self.none_of_these + self.nothing_missing);
            (self.none_of_these, self.nothing_missing) = (each, each);
        }
        self
    }

    /// The most probable answers in words, and what is left of the gap.
    pub fn lines(&self) -> Vec<String> {
        let sets = self.sets.iter().take(TOLD).map(|set| {
            let instead = set.replaced.iter().map(|term| format!(" instead of {term}"));
            (set.probability, set.names.join(" + ") + &instead.collect::<String>())
        });
        let others = [
            (self.none_of_these, "none of these: something that was not tried".to_owned()),
            (self.nothing_missing, "nothing is missing".to_owned()),
        ];
        let told = sets.chain(others).filter(|(probability, _)| *probability >= SPOKEN);
        let mut lines: Vec<String> = told.map(|(p, what)| format!("{}: {what}", percent(p))).collect();
        lines.push(format!("{} of the gap is left", percent(self.discrepancy)));
        lines
    }
}

/// The probabilities after a verdict; `None` where there is no gap.
pub(crate) fn probabilities(
    rows: &Rows,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
) -> Option<Probabilities> {
    if decision.verdict == Verdict::NoGap {
        return None;
    }
    let is_answered = decision.verdict != Verdict::Unexplained;
    let counted: Vec<&JudgedFit<'_>> = found.judged.iter().filter(|j| counts(j, is_answered)).collect();
    let best = decision.best.map(|i| &found.judged[i]);
    let nearest = best.or(counted.first().copied());
    let excess = |chi2: f64| (chi2 - rows.train.len() as f64).max(0.0);
    let (was, is) = (excess(found.before.train), nearest.map_or(found.before.train, |j| j.misfit.train));
    let discrepancy = if was > 0.0 { (excess(is) / was).min(1.0) } else { 0.0 };
    let inflation = nearest.map_or(found.adequacy.inflation, |j| j.inflation);
    // An effect pays what a search gains by chance; those beyond the first have paid in their gain.
    let support = |of: f64| 0.5 * (of / inflation - found.null_distribution.threshold);
    let class: Vec<&JudgedFit<'_>> = if is_answered {
        best.into_iter().chain(decision.rivals.iter().map(|i| &found.judged[*i])).collect()
    } else {
        Vec::new()
    };
    let lift = lift(&counted, &class);
    let mut weights: Vec<(ProbableSet, f64)> = Vec::new();
    for judged in counted {
        let of_class = class.iter().any(|told| holds(judged, told));
        if !of_class || is_among(judged, &class) {
            let lift = if of_class { lift } else { 0.0 };
            add(
                &mut weights,
                judged.names(),
                &judged.fit.variant.left_out,
                support(judged.standing() + lift),
            );
        }
    }
    // What was not refitted and does the same as what is told has its support, but for the prior.
    if let Some(best) = best.filter(|_| is_answered) {
        for set in &decision.tied {
            let of = |name: &String| candidates.iter().find(|c| c.name() == name);
            let Some(members) = set.iter().map(of).collect::<Option<Vec<_>>>() else { continue };
            let prior = inflation * members.iter().map(|c| c.kind.price()).sum::<f64>();
            if !found.judged.iter().any(|j| j.names() == *set) {
                let left_out = &best.fit.variant.left_out;
                add(&mut weights, set.clone(), left_out, support(best.rank() - prior + lift));
            }
        }
    }
    weights.retain(|(set, _)| !decision.synonyms.contains(&set.names.join(" + ")));
    let is_untested = best.is_some_and(|j| j.adequacy.whiteness.is_none());
    let kinds = best.map_or_else(Vec::new, JudgedFit::kinds);
    let of_verdict = odds(decision.verdict, &kinds, is_untested) * UNLISTED / (1.0 - UNLISTED);
    let listed = 1.0 / (1.0 + of_verdict);
    let left = best.filter(|_| is_answered).map(|j| &j.adequacy);
    let listed = left.map_or(listed, |left| still_listed(listed, left, discrepancy));
    let could_be_noise = !is_answered && !larger(rows, &found.base.predicted).is_empty();
    let probabilities = shared(weights, listed, discrepancy).with_gap(found.adequacy.is_gap_of_the_model());
    Some(probabilities.with_noise(could_be_noise))
}

/// How often a verdict for effects of these kinds falls where the truth is in no list, over how often where it is.
fn odds(verdict: Verdict, kinds: &[Kind], is_untested: bool) -> f64 {
    let counted = match verdict {
        Verdict::Named | Verdict::Tie if kinds.contains(&Kind::Proposal) => PROPOSED,
        Verdict::Named if kinds.len() > 1 => PAIRED,
        Verdict::Named => NAMED,
        Verdict::Tie => TIED,
        Verdict::Unexplained => UNEXPLAINED,
        Verdict::NoGap => 0.0,
    };
    if is_untested { counted.max(UNTESTED) } else { counted }
}

/// The probability that the truth is in the list, with these residuals: where they may hide a gap again, as much of it as is left is in no list.
fn still_listed(listed: f64, left: &Adequacy, discrepancy: f64) -> f64 {
    if left.may_hide_a_gap() { listed * (1.0 - discrepancy) } else { listed }
}

/// Whether a variant has a say: it passes the gates, or, where nothing explains the gap, is at least possible.
fn counts(judged: &JudgedFit<'_>, is_answered: bool) -> bool {
    judged.refusal.as_ref().is_none_or(|refusal| !is_answered && !refusal.is_impossible())
}

/// By how much a set that adds something small to one of a class does better than the class. It speaks against none of that, since the same may stand
/// beside each, and so counts for all of it.
fn lift(counted: &[&JudgedFit<'_>], class: &[&JudgedFit<'_>]) -> f64 {
    let most = |of: &mut dyn Iterator<Item = f64>| of.fold(f64::NEG_INFINITY, f64::max);
    let with_more = counted.iter().filter(|judged| class.iter().any(|told| holds(judged, told)));
    let with_more = most(&mut with_more.map(|judged| judged.standing()));
    let alone = most(&mut class.iter().map(|told| told.standing()));
    if class.is_empty() { 0.0 } else { (with_more - alone).max(0.0) }
}

/// Whether a variant is one of these.
fn is_among(judged: &JudgedFit<'_>, class: &[&JudgedFit<'_>]) -> bool {
    class.iter().any(|told| holds(judged, told) && holds(told, judged))
}

/// Whether a variant has all the effects of another.
fn holds(judged: &JudgedFit<'_>, other: &JudgedFit<'_>) -> bool {
    let (names, left_out) = (judged.names(), &judged.fit.variant.left_out);
    *left_out == other.fit.variant.left_out && other.names().iter().all(|name| names.contains(name))
}

/// Gives a set its log weight, the largest of those that it is given.
fn add(weights: &mut Vec<(ProbableSet, f64)>, names: Vec<String>, replaced: &[String], weight: f64) {
    let known = weights.iter_mut().find(|(set, _)| set.names == names && set.replaced == replaced);
    match known {
        Some((_, most)) => *most = most.max(weight),
        None => weights.push((ProbableSet { names, replaced: replaced.to_vec(), probability: 0.0 }, weight)),
    }
}

/// Shares the probability that the truth is in the list among its sets and the model as it is, whose log weight is zero.
fn shared(weights: Vec<(ProbableSet, f64)>, listed: f64, discrepancy: f64) -> Probabilities {
    let most = weights.iter().map(|(_, w)| *w).fold(0.0, f64::max);
    let nothing = (-most).exp();
    let sum = nothing + weights.iter().map(|(_, w)| (w - most).exp()).sum::<f64>();
    let probable =
        |(set, w): (ProbableSet, f64)| ProbableSet { probability: listed * (w - most).exp() / sum, ..set };
    let mut sets: Vec<ProbableSet> = weights.into_iter().map(probable).collect();
    sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Probabilities { sets, nothing_missing: listed * nothing / sum, none_of_these: 1.0 - listed, discrepancy }
}

#[cfg(test)]
mod tests;
