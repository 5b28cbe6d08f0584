//! The sentences of an explanation: each is made from the figures that it stands beside.
//!
//! Sentences about noise are in [`crate::judge::adequacy`], those about held-out data in [`crate::judge::held_out`]. Next file
//! to read: [`super::warnings`].

use starlings_models::quoted_list;
use std::fmt::Write as _;

use super::correlated::{correlated_noise, listed as listed_noise, sentence as noise_sentence};
use super::errors::shrinking;
use super::result::CorrelatedChannel;
use super::tie::{first, tied};
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::judge::adequacy::Nature;
use crate::judge::gates::JudgedFit;
use crate::judge::held_out::{HeldOut, listed};
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict};
use crate::locate::Located;
use crate::number::{percent, times};
use crate::run_cache::RunCache;
use crate::screen::not_tried;

/// Share of the gap below which what is left is not spoken of: with one digit it would read as nothing.
const LITTLE: f64 = 5e-4;

/// The verdict in a few sentences.
pub(crate) fn headline(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
) -> String {
    let best = decision.best.map(|i| &found.judged[i]);
    let noise = correlated_noise(cache.study, &cache.rows);
    let verdict = match (decision.verdict, best) {
        (Verdict::Named, Some(judged)) => {
            let shrinking = capital(&shrinking(cache, found, judged));
            format!(
                "{}{}{} {shrinking}{}",
                subject(judged),
                of_no_field(judged),
                same(decision),
                remains(judged)
            )
        }
        (Verdict::Tie, Some(judged)) => {
            format!(
                "{}{}{} {}{}",
                tied(&judged.fit.variant.name(), &subject(judged), &decision.tied),
                likelier(judged, decision, found, candidates),
                same(decision),
                capital(&shrinking(cache, found, judged)),
                remains(judged)
            )
        }
        (Verdict::Unexplained, _) => unexplained(cache, found, candidates, decision),
        _ => {
            let why = too_small(cache, found).map(|why| format!(" {why}"));
            return no_gap(found, &noise) + &why.unwrap_or_default();
        }
    };
    verdict + &noise_sentence(&noise)
}

/// That nothing explains the gap, why, what fails of what was held out, and what was not tried.
fn unexplained(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
) -> String {
    let because = if decision.because.is_empty() { String::new() } else { format!(": {}", decision.because) };
    let nearest = decision.best.or((!found.judged.is_empty()).then_some(0)).map(|i| &found.judged[i]);
    let because = format!("Nothing that was tried explains the gap{}.", because.trim_end_matches('.'));
    let mut sentences = vec![too_small(cache, found).unwrap_or(because)];
    let of = nearest.map_or(&found.held_out, |j| &j.held_out);
    let failing: Vec<&HeldOut> = of.iter().filter(|h| h.fails).collect();
    if !failing.is_empty() {
        let with = nearest.map_or_else(String::new, |j| format!(" with `{}`", j.fit.variant.name()));
        sentences.push(format!("Held out and failing{with}: {}.", listed(&failing)));
    }
    if nearest.is_none() {
        sentences.push(format!("On the training data {}.", found.adequacy.says()));
    }
    let not_tried = not_tried::sentence(cache.study, candidates);
    if !not_tried.is_empty() {
        sentences.push(not_tried);
    }
    sentences.join(" ")
}

/// That the data show no gap, with what they could have shown.
fn no_gap(found: &SearchResult<'_>, noise: &[CorrelatedChannel]) -> String {
    let says = found.adequacy.says();
    let is_assumed = noise.iter().any(|of| of.sd.is_some());
    let training = match found.adequacy.nature() {
        Nature::Noise | Nature::Smaller if is_assumed => format!(
            "No gap that these data show: what the model leaves may be noise that is correlated in time, whose size the study does not \
             state: {}. In units of that noise {says}.",
            listed_noise(noise)
        ),
        Nature::Noise | Nature::Smaller if !noise.is_empty() => {
            format!(
                "No gap, the noise is correlated in time: {}. In units of that noise {says}.",
                listed_noise(noise)
            )
        }
        Nature::Nothing => return format!("No gap could be seen: {says}."),
        Nature::Noise if found.adequacy.whiteness.is_some() => {
            format!("No gap: the model explains the training data at their noise; {says}.")
        }
        _ => format!("No gap that these data show: {says}."),
    };
    let largest = found.held_out.iter().map(|h| h.after).fold(f64::NAN, f64::max);
    if largest.is_nan() {
        return training;
    }
    let explained = if found.adequacy.is_numerical() {
        ""
    } else {
        ", no more than noise and the uncertainty of the estimate explain"
    };
    format!("{training} What was held out is {} its noise at most{explained}.", times(largest))
}

fn subject(judged: &JudgedFit<'_>) -> String {
    let variant = &judged.fit.variant;
    let says: Vec<String> = variant.effects.iter().map(|m| sentence(&m.candidate.def.says)).collect();
    let is_made = judged.kinds().contains(&Kind::Proposal);
    let begins = if is_made { "A proposal, made from these data" } else { "Missing" };
    format!("{begins}: {}. {}", variant.name(), says.join(" ").trim())
}

/// A text with the full stop that its author may have left out.
fn sentence(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() || text.ends_with(['.', '!', '?', '…']) {
        text.to_owned()
    } else {
        format!("{text}.")
    }
}

/// That the budget ended before anything was tried, and what it would have to be; nothing where something was.
fn too_small(cache: &RunCache<'_>, found: &SearchResult<'_>) -> Option<String> {
    let (budget, needed) = cache.too_small().filter(|_| found.screening.is_empty())?;
    Some(format!(
        "The budget of {budget} runs is too small: nothing was tried; a first look at every effect needs {needed}, refits \
         several times as many."
    ))
}

/// That a generic term is no physics; empty for an effect of a field.
fn of_no_field(judged: &JudgedFit<'_>) -> &'static str {
    if judged.kinds().iter().any(|kind| kind.is_of_no_field()) {
        " That describes a dependence and not its cause."
    } else {
        ""
    }
}

/// Why what is told first of a tie is: as the simplest of its kind, or by the prior; empty where it is first by the data.
fn likelier(
    judged: &JudgedFit<'_>,
    decision: &Decision,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
) -> String {
    let name = judged.fit.variant.name();
    let rivals = decision.rivals.iter().map(|i| &found.judged[*i]);
    let best = rivals.max_by(|a, b| a.standing().total_cmp(&b.standing()));
    let better = best.filter(|best| best.standing() > judged.standing() && best.kinds() == judged.kinds());
    let told = judged.kinds().first().copied().unwrap_or_default();
    let tied = decision.tied.iter().flatten();
    let kinds = tied.filter_map(|name| candidates.iter().find(|c| c.name() == name)).map(|c| c.kind);
    first(&name, told, better.map(|best| best.fit.variant.name()).as_deref(), kinds.max())
}

/// Other names of what is named; empty without any.
fn same(decision: &Decision) -> String {
    if decision.synonyms.is_empty() {
        return String::new();
    }
    format!(" The same effect by another name: {}.", quoted_list(&decision.synonyms))
}

/// What is left beside the name, where that is no noise: how much, and where it shows in what was held out. Empty where nothing is.
fn remains(judged: &JudgedFit<'_>) -> String {
    let failing: Vec<&HeldOut> = judged.held_out.iter().filter(|h| h.fails).collect();
    let left = (1.0 - judged.share).max(0.0);
    if failing.is_empty() && !(judged.adequacy.is_gap() && left > LITTLE) {
        return String::new();
    }
    let left = percent(left);
    let unseen = if failing.is_empty() {
        String::new()
    } else {
        format!("; of what was held out, {}", listed(&failing))
    };
    format!(" Something smaller remains: {left} of the gap on the training data{unseen}.")
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The shape of what remains.
pub(crate) fn shape(found: &SearchResult<'_>, added: Option<&JudgedFit<'_>>, before: &Located) -> String {
    let adequacy = added.map_or(&found.adequacy, |j| &j.adequacy);
    let mut text = adequacy.says();
    if adequacy.nature() != Nature::Correlated {
        return text;
    }
    match added {
        Some(judged) => {
            let _ = write!(text, "; against a smooth signal they count {} one", times(judged.inflation));
            if let Some(left) = judged.leftover.filter(|left| left.share > 0.0) {
                let share = percent(left.share);
                let _ = write!(
                    text,
                    "; of what lies above the noise, candidates and bent forms of the effect would take away {share}, to first order"
                );
            }
        }
        None => {
            if let Some(strongest) = before.correlations.first() {
                let _ = write!(text, "; those of {} go along with {}", strongest.channel, strongest.with);
            }
        }
    }
    text
}

/// What the intervals and the verdict rest on.
pub(crate) fn conditional_on(added: Option<&JudgedFit<'_>>) -> String {
    let widened = added.map(|j| j.inflation.sqrt()).filter(|factor| *factor > 1.005);
    let noise = widened.map_or_else(String::new, |factor| {
        format!(
            " Intervals are widened by a factor of {factor:.2} for the size and correlation of the residuals."
        )
    });
    format!(
        "A verdict names the best member of this library; an effect that is not in it can resemble one that is. Intervals hold \
         for the model with the named effects, the stated noise, and parameters close to linear within them.{noise}"
    )
}

/// Candidates that the budget left without a refit.
pub(crate) fn untried(found: &SearchResult<'_>, candidates: &[Candidate]) -> Vec<String> {
    if !found.cut_short {
        return Vec::new();
    }
    let seen =
        |index: usize| found.judged.iter().any(|j| j.fit.variant.effects.iter().any(|m| m.index == index));
    let open = candidates.iter().enumerate().filter(|(i, _)| !seen(*i));
    open.map(|(_, c)| c.name().to_owned()).collect()
}
