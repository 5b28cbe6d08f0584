//! Which terms a drift lacks: candidates are scored by the sums of one pass through the data, alone, in pairs and in exchange.
//!
//! The score of candidates is the F test of their coefficients beside all that is fitted already, so what the fitted terms can take
//! over counts for nothing. The best enters while its probability by chance, times the number of candidates (Bonferroni), stays
//! below the rate of false alarms; after each entry the earlier ones are asked again and may be exchanged, which undoes wrong first
//! steps. What does as well in its place is told as a tie. Deliberately no verdict on terms that are in no list: `joint` of a generic
//! family answers whether anything is left. Read next: `subset.rs`, the fit of some of the coefficients.

use super::subset::{Subset, score};
use super::{Fit, InferenceError, Posterior, Structure, Sums};

/// Odds below which two terms count as a tie.
const ODDS: f64 = 20.0;
/// Pairs are tried for at most this many candidates, the best alone.
const PAIRED: usize = 40;

/// How missing terms are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Probability of naming anything where nothing is missing.
    pub false_alarm: f64,
    /// Terms named at most.
    pub most: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { false_alarm: 0.01, most: 4 }
    }
}

/// A coefficient that may be missing, by its index in the structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Index of the coefficient in the structure.
    pub coefficient: usize,
    /// Values that physics allows.
    pub range: [f64; 2],
}

/// What the data say of candidates beside the terms that are fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Indices of their coefficients.
    pub coefficients: Vec<usize>,
    /// χ² of their coefficients against zero, one degree of freedom each.
    pub chi_squared: f64,
    /// Probability of as much by chance, for these alone.
    pub by_chance: f64,
    /// Whether their values agree with what physics allows, within two sd.
    pub allowed: bool,
}

/// A term that is named, and those that the data take as well in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Index of its coefficient.
    pub coefficient: usize,
    /// Its score beside everything else that is named.
    pub score: Score,
    /// Indices of coefficients in a tie with it.
    pub ties: Vec<usize>,
}

/// The answer of a search.
#[derive(Debug, Clone)]
pub struct Missing {
    /// The terms that are named, in the order of their coefficients.
    pub named: Vec<Named>,
    /// Every candidate's score beside the terms of the model alone, the strongest first. Those that the model's terms span are not
    /// there.
    pub alone: Vec<Score>,
    /// The fit with the named terms: coefficients that are not part of it are absent.
    pub posterior: Posterior,
    /// The fit of the model without any candidate.
    pub model: Posterior,
}

/// Looks for missing terms among the candidates; all other coefficients of the structure are the model's.
///
/// # Errors
/// As for [`Fit::posterior`] of the model without candidates; `Unknown` for a candidate that is no coefficient.
pub fn missing_terms(
    fit: &Fit,
    sums: &Sums,
    structure: &Structure,
    candidates: &[Candidate],
    search: Search,
) -> Result<Missing, InferenceError> {
    let hunt = Hunt { subset: Subset { fit, sums, structure }, candidates, search };
    hunt.check()?;
    let model = hunt.model();
    let without = hunt.subset.posterior(&model)?;
    let alone = hunt.scores(&model);
    let mut named = Vec::new();
    while named.len() < search.most {
        let Some(more) = hunt.next(&model, &named) else { break };
        named.extend(more);
        hunt.exchange(&model, &mut named);
        named.sort_unstable();
    }
    hunt.prune(&model, &mut named);
    let posterior = hunt.subset.posterior(&joined(&model, &named))?;
    let named = named.iter().map(|c| hunt.named(&model, &named, *c)).collect::<Result<_, _>>()?;
    Ok(Missing { named, alone, posterior, model: without })
}

/// χ² of a family of coefficients together beside all others of the structure, without those that the others span: whether anything
/// of its kind is left in the data. `None` where the others span the whole family.
///
/// # Errors
/// As for [`Fit::posterior`] of the structure without the family.
pub fn joint(
    fit: &Fit,
    sums: &Sums,
    structure: &Structure,
    family: &[usize],
) -> Result<Option<Score>, InferenceError> {
    let subset = Subset { fit, sums, structure };
    let others: Vec<usize> = (0..structure.n_coefficient()).filter(|c| !family.contains(c)).collect();
    subset.posterior(&others)?;
    let mut kept: Vec<usize> = Vec::new();
    for coefficient in family {
        let more = joined(&kept, &[*coefficient]);
        match subset.posterior(&joined(&others, &more)) {
            Ok(posterior) if posterior.active().contains(coefficient) => kept = more,
            _ => {}
        }
    }
    if kept.is_empty() {
        return Ok(None);
    }
    let posterior = subset.posterior(&joined(&others, &kept))?;
    Ok(score(&posterior, &kept, |_| true))
}

struct Hunt<'a> {
    subset: Subset<'a>,
    candidates: &'a [Candidate],
    search: Search,
}

impl Hunt<'_> {
    fn check(&self) -> Result<(), InferenceError> {
        let n = self.subset.structure.n_coefficient();
        match self.candidates.iter().find(|c| c.coefficient >= n) {
            Some(c) => Err(InferenceError::Unknown { what: "coefficient", name: c.coefficient.to_string() }),
            None => Ok(()),
        }
    }

    /// The coefficients that are no candidates.
    fn model(&self) -> Vec<usize> {
        let candidate = |c: &usize| self.candidates.iter().any(|k| k.coefficient == *c);
        (0..self.subset.structure.n_coefficient()).filter(|c| !candidate(c)).collect()
    }

    fn allowed(&self, posterior: &Posterior, coefficient: usize) -> bool {
        let range = self.candidates.iter().find(|c| c.coefficient == coefficient).map(|c| c.range);
        let (Some([lo, hi]), Some(value)) = (range, posterior.estimates[coefficient].value) else {
            return false;
        };
        value.mean + 2.0 * value.sd >= lo && value.mean - 2.0 * value.sd <= hi
    }

    /// The score of coefficients beside others; `None` where the data cannot tell them from these.
    fn score(&self, others: &[usize], coefficients: &[usize]) -> Option<Score> {
        let posterior = self.subset.posterior(&joined(others, coefficients)).ok()?;
        score(&posterior, coefficients, |c| self.allowed(&posterior, c))
    }

    /// Scores of all candidates that are not among the others, the strongest first.
    fn scores(&self, others: &[usize]) -> Vec<Score> {
        let free = self.candidates.iter().map(|c| c.coefficient).filter(|c| !others.contains(c));
        let mut scores: Vec<Score> = free.filter_map(|c| self.score(others, &[c])).collect();
        scores.sort_by(|a, b| b.chi_squared.total_cmp(&a.chi_squared));
        scores
    }

    /// The terms to add: the best alone, else the best pair.
    fn next(&self, model: &[usize], named: &[usize]) -> Option<Vec<usize>> {
        let others = joined(model, named);
        let scores = self.scores(&others);
        let sure = |score: &Score, tried: usize| {
            score.allowed && score.by_chance * (tried as f64) < 0.5 * self.search.false_alarm
        };
        let single = scores.iter().find(|s| sure(s, self.candidates.len()));
        if let Some(single) = single {
            return Some(single.coefficients.clone());
        }
        if named.len() + 2 > self.search.most {
            return None;
        }
        let paired: Vec<usize> = scores.iter().take(PAIRED).map(|s| s.coefficients[0]).collect();
        let n_pair = self.candidates.len() * self.candidates.len().saturating_sub(1) / 2;
        let pairs = paired.iter().enumerate().flat_map(|(i, a)| paired[i + 1..].iter().map(|b| vec![*a, *b]));
        let scored = pairs.filter_map(|pair| self.score(&others, &pair)).filter(|s| sure(s, n_pair));
        let best = scored.max_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared))?;
        Some(best.coefficients)
    }

    /// Replaces a named term by a candidate that the data take better, as long as there is one.
    fn exchange(&self, model: &[usize], named: &mut Vec<usize>) {
        for _ in 0..self.candidates.len() {
            let Some((old, new)) = self.better(model, named) else { return };
            named.retain(|c| *c != old);
            named.push(new);
        }
    }

    /// The best exchange of one named term, at the noise of what is named.
    fn better(&self, model: &[usize], named: &[usize]) -> Option<(usize, usize)> {
        let now = self.subset.posterior(&joined(model, named)).ok()?;
        let here = self.subset.log_likelihood(&now, &now.diffusion)?;
        let gain = |old: usize, new: usize| {
            let posterior = self.subset.posterior(&joined(model, &swapped(named, old, new))).ok()?;
            let there = self.subset.log_likelihood(&posterior, &now.diffusion)?;
            let better = there > here + 1e-9 * here.abs() && self.allowed(&posterior, new);
            better.then_some((old, new, there))
        };
        let free = |new: &usize| !named.contains(new);
        let new = || self.candidates.iter().map(|c| c.coefficient).filter(free);
        let all = named.iter().flat_map(|old| new().filter_map(move |new| gain(*old, new)));
        all.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(old, new, _)| (old, new))
    }

    /// Takes away what the other named terms have made superfluous, the least sure first.
    fn prune(&self, model: &[usize], named: &mut Vec<usize>) {
        let by_chance = |named: &[usize], c: usize| {
            let score = self.score(&joined(model, &without(named, c)), &[c]);
            score.filter(|s| s.allowed).map_or(1.0, |s| s.by_chance)
        };
        let n = self.candidates.len() as f64;
        while let Some((weakest, chance)) =
            named.iter().map(|c| (*c, by_chance(named, *c))).max_by(|a, b| a.1.total_cmp(&b.1))
        {
            if chance * n < self.search.false_alarm {
                return;
            }
            named.retain(|c| *c != weakest);
        }
    }

    fn named(&self, model: &[usize], all: &[usize], coefficient: usize) -> Result<Named, InferenceError> {
        let with = self.subset.posterior(&joined(model, all))?;
        let overflow = InferenceError::Overflow { what: "the score of a named term" };
        let score = self.score(&joined(model, &without(all, coefficient)), &[coefficient]).ok_or(overflow)?;
        let here = self.subset.log_likelihood(&with, &with.diffusion);
        let as_good = |new: &usize| {
            let there = self.subset.posterior(&joined(model, &swapped(all, coefficient, *new))).ok();
            let there = there.filter(|p| self.allowed(p, *new));
            let there = there.and_then(|p| self.subset.log_likelihood(&p, &with.diffusion));
            matches!((here, there), (Some(here), Some(there)) if here - there < ODDS.ln())
        };
        let free = self.candidates.iter().map(|c| c.coefficient).filter(|c| !all.contains(c));
        Ok(Named { coefficient, score, ties: free.filter(as_good).collect() })
    }
}

/// Both, in rising order.
fn joined(a: &[usize], b: &[usize]) -> Vec<usize> {
    let mut all: Vec<usize> = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all
}

fn without(all: &[usize], one: usize) -> Vec<usize> {
    all.iter().copied().filter(|c| *c != one).collect()
}

fn swapped(all: &[usize], old: usize, new: usize) -> Vec<usize> {
    let mut all = without(all, old);
    all.push(new);
    all
}
