//! The verdict on the variants that a search found: named, tie, unexplained or no gap.
//!
//! A variant is named if it passes every gate, no rival comes close, and neither candidates nor modulated forms would lower
//! what it leaves beyond chance. Otherwise the verdict is a tie, or unexplained with the variant that came nearest. Next file
//! to read: [`crate::tell::summary`].

use starlings_models::equations::{Expression, Slot};

use super::contribution::{ContributionCheck, DISCREPANT, check_contributions};
use super::gates::JudgedFit;
use super::objections::{nearest_refused, objection};
use super::rivals::{MARGIN, rivals};
use super::search_result::SearchResult;
use super::twins::twins;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::fit::model_variant::AddedEffect;
use crate::fit::same_form::same_form;
use crate::run_cache::RunCache;
use serde::{Deserialize, Serialize};

/// Fall of χ² by a fully modulated form that the data must allow before a form counts as tested. A form modulated by half makes a
/// quarter of it, which exceeds the 12 units of the check of the form nine times in ten: 4 (√12 + 1.28)².
const POWER: f64 = 90.0;
/// Posterior over prior standard deviation above which the data do not determine a parameter inside a term.
const UNINFORMED: f64 = 0.5;
/// Difference in χ² below which it is a toss-up which of a class is told first: odds of two to one.
const TOSS_UP: f64 = 1.4;

/// The verdict on a misfit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// One effect, or one set of effects, explains the gap and no other does.
    Named,
    /// Several explain it about equally well: the data cannot tell them apart.
    Tie,
    /// There is a gap, and nothing in the library explains it.
    Unexplained,
    /// The model explains the data at their noise.
    NoGap,
}

/// The verdict, with positions in [`SearchResult::judged`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// What is named, or the best supported of the tied, or what came nearest.
    pub best: Option<usize>,
    /// What came first by rank, and whose form was checked; in a tie it may differ from `best`.
    pub checked: Option<usize>,
    /// Names of the sets of effects tied with the best.
    pub tied: Vec<Vec<String>>,
    /// Positions of those of the tied that were refitted.
    pub rivals: Vec<usize>,
    /// Other names of the same effects among the candidates.
    pub synonyms: Vec<String>,
    /// Why it is not named, in words.
    pub because: String,
}

/// Decides on what a search found.
///
/// # Errors
/// When the store fails.
pub(crate) fn decide(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
) -> Result<Decision, ExplainError> {
    let none = |verdict, best, because: &str| Decision {
        verdict,
        best,
        checked: best,
        tied: Vec::new(),
        rivals: Vec::new(),
        synonyms: Vec::new(),
        because: because.to_owned(),
    };
    let passing = found.passing();
    if passing.is_empty() {
        return Ok(if found.adequacy.is_gap_of_the_model() || found.held_out.iter().any(|h| h.fails) {
            none(Verdict::Unexplained, None, &nearest_refused(found))
        } else {
            none(Verdict::NoGap, None, "")
        });
    }
    let ContributionCheck { best, checked, because } = check_contributions(found, &passing);
    let judged = &found.judged[best];
    let leftover = found.judged[checked].leftover.unwrap_or_default();
    let because = because.or_else(|| objection(cache, found, judged, leftover));
    if let Some(because) = because {
        return Ok(Decision { checked: Some(checked), ..none(Verdict::Unexplained, Some(best), &because) });
    }
    // Beside a discrepancy of another kind the check of the form says nothing.
    let is_tested = judged.inflation > DISCREPANT || leftover.power >= POWER;
    let mut rivals = rivals(cache, found, &passing, best);
    let best = shown(found, best, &mut rivals);
    let judged = &found.judged[best];
    let (mut tied, synonyms) = class(cache, found, candidates, judged, &mut rivals)?;
    if !is_tested {
        tied.push(vec![another_form(&judged.fit.variant.name())]);
    }
    tied.extend(limits(judged).into_iter().map(|limit| vec![limit]));
    let verdict = if tied.is_empty() { Verdict::Named } else { Verdict::Tie };
    let because = String::new();
    Ok(Decision { verdict, best: Some(best), checked: Some(checked), tied, rivals, synonyms, because })
}

/// What stands for every form of a dependence that the data would not tell from what is named.
pub(crate) fn another_form(name: &str) -> String {
    format!("another form of {name}")
}

/// What stands for the forms that a term takes where a parameter inside it becomes small or large.
pub(crate) fn at_a_limit(name: &str, parameter: &str) -> String {
    format!("{name} at a limit of {parameter}")
}

/// The parameter of [`at_a_limit`].
pub(crate) fn parameter_at_limit(form: &str) -> Option<&str> {
    form.split_once(" at a limit of ").map(|(_, parameter)| parameter)
}

/// What is told of a class. What was the best takes its place among the rivals.
fn shown(found: &SearchResult<'_>, best: usize, rivals: &mut [usize]) -> usize {
    let class: Vec<usize> = std::iter::once(best).chain(rivals.iter().copied()).collect();
    let judged = class.iter().map(|i| &found.judged[*i]);
    let described: Vec<_> = judged.map(|j| (j.standing(), j.kinds(), complexity(j))).collect();
    let is_law = |kinds: &Vec<Kind>| kinds.iter().all(|kind| kind.is_of_a_field());
    let told = class[leading(&described, is_law, found.judged[best].inflation)];
    if let Some(place) = rivals.iter_mut().find(|i| **i == told) {
        *place = best;
    }
    told
}

/// The position of what is best supported, the prior included. Of what is a toss-up with it the likeliest before any data is told, and of that the
/// simplest. A law of a field gives way to any simpler one that is tied with it; a term that describes a dependence has nothing but its support.
/// `unit` is the effective noise.
fn leading<K: Ord, C: Ord>(class: &[(f64, K, C)], is_law: impl Fn(&K) -> bool, unit: f64) -> usize {
    let Some(best) = class.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return 0 };
    let is_near = |(standing, kind, _): &(f64, K, C)| {
        let behind = best.0 - standing;
        behind <= TOSS_UP * unit || (behind <= MARGIN * unit && *kind == best.1 && is_law(kind))
    };
    let near = class.iter().enumerate().filter(|(_, of)| is_near(of));
    let told = near.min_by(|(_, a), (_, b)| (&a.1, &a.2).cmp(&(&b.1, &b.2)).then(b.0.total_cmp(&a.0)));
    told.map_or(0, |(i, _)| i)
}

/// The sets of effects that are tied with what is shown, and its other names, which are no rivals.
fn class(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    judged: &JudgedFit<'_>,
    rivals: &mut Vec<usize>,
) -> Result<(Vec<Vec<String>>, Vec<String>), ExplainError> {
    let own = &judged.fit.variant;
    let is_same = |names: &[String]| {
        let of = |name: &String| candidates.iter().find(|c| c.name() == name).map(|c| &c.def);
        let is_there =
            |e: &AddedEffect<'_>| names.iter().filter_map(of).any(|def| same_form(&e.candidate.def, def));
        names.len() == own.effects.len() && own.effects.iter().all(is_there)
    };
    let is_other_name = |other: &JudgedFit<'_>| {
        let variant = &other.fit.variant;
        variant.left_out == own.left_out && other.names() != judged.names() && is_same(&other.names())
    };
    rivals.retain(|i| !is_other_name(&found.judged[*i]));
    let refitted = found.judged.iter().filter(|j| is_other_name(j));
    let mut synonyms: Vec<String> = refitted.map(|j| j.names().join(" + ")).collect();
    let mut tied: Vec<Vec<String>> = rivals.iter().map(|i| found.judged[*i].names()).collect();
    for twin in twins(cache, found, judged, candidates)?.iter().filter(|twin| twin.is_tied()) {
        let twin = vec![twin.candidate.name().to_owned()];
        if is_same(&twin) {
            synonyms.extend(twin);
        } else if !tied.contains(&twin) {
            tied.push(twin);
        }
    }
    synonyms.sort();
    synonyms.dedup();
    Ok((tied, synonyms))
}

/// The limiting forms that the data do not exclude: those of a parameter inside a term that they do not determine.
pub(crate) fn limits(judged: &JudgedFit<'_>) -> Vec<String> {
    let variant = &judged.fit.variant;
    let Ok(optimum) = judged.fit.optimum() else { return Vec::new() };
    let mut limits = Vec::new();
    for (m, effect) in variant.effects.iter().enumerate() {
        for (k, parameter) in effect.candidate.def.parameters.iter().enumerate().skip(1) {
            if !effect.candidate.is_of_its_form(parameter) {
                continue;
            }
            let j = variant.first_entry_of(m) + k;
            // z counts in prior sd.
            let sd = (optimum.covariance()[(j, j)].max(0.0) * judged.inflation).sqrt();
            if sd > UNINFORMED {
                limits.push(at_a_limit(effect.candidate.name(), &parameter.name));
            }
        }
    }
    limits
}

/// Number of operations in the terms of a variant; of variants that are equal otherwise the one with the fewest is shown.
fn complexity(judged: &JudgedFit<'_>) -> usize {
    let terms = judged.fit.variant.effects.iter().flat_map(|m| &m.candidate.def.adds);
    terms.filter_map(|add| n_operations(&add.term)).sum()
}

/// Number of operations in a term, whatever its sign.
fn n_operations(term: &str) -> Option<usize> {
    let resolve = |_: &str| Some(Slot::Parameter(0));
    let unsigned = Expression::parse(term.trim_start_matches('-')).ok()?;
    Some(unsigned.compile(&resolve, &|_| None).ok()?.n_operations())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_as_simple_as_a_gain() {
        assert_eq!(n_operations("-k*x"), n_operations("k*y"));
        assert!(n_operations("-k*x*abs(x)") > n_operations("k*x"));
    }

    #[test]
    fn of_a_tie_the_best_supported_is_told_and_the_simplest_of_a_toss_up_or_of_laws() {
        let leading = |class: &[(f64, char, usize)], unit| leading(class, |kind| *kind == 'l', unit);
        // A term of two operations beside the best, which has three, and a constant of a likelier kind that is behind.
        let class = |kind: char, simpler: f64, constant: f64| {
            [(100.0, kind, 3), (100.0 - simpler, kind, 2), (100.0 - constant, 'c', 0)]
        };
        assert_eq!(leading(&class('p', 5.0, 5.0), 1.0), 0, "tied, and less supported");
        assert_eq!(leading(&class('l', 5.0, 5.0), 1.0), 1, "the linear law of two that are tied");
        assert_eq!(leading(&class('l', 7.0, 5.0), 1.0), 0, "no longer tied");
        assert_eq!(leading(&class('p', 1.0, 5.0), 1.0), 1, "a toss-up, and simpler");
        assert_eq!(leading(&class('p', 1.0, 1.0), 1.0), 2, "a toss-up, and likelier before any data");
        // What a pair ended in may stand behind another single effect.
        assert_eq!(leading(&class('p', -7.0, 9.0), 1.0), 1);
        assert_eq!(leading(&[(90.0, 'p', 0), (91.0, 'p', 0)], 1.0), 1, "of two that are equal otherwise");
        assert_eq!(
            leading(&class('p', 5.0, 9.0), 10.0),
            2,
            "in residuals of a larger effective noise all are equal"
        );
    }
}
