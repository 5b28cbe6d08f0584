//! Which of several results comes first.
//!
//! Next file to read: [`super::search`], which asks.

use std::cmp::Ordering;

use crate::judge::gates::JudgedFit;
use crate::screen::screening_result::ScreeningResult;

/// Those that pass the gates first, then by rank and prior.
pub(super) fn order(a: &JudgedFit<'_>, b: &JudgedFit<'_>) -> Ordering {
    let refused = |j: &JudgedFit<'_>| j.refusal.is_some();
    refused(a).cmp(&refused(b)).then(b.standing().total_cmp(&a.standing()))
}

/// The result with the largest gain of every candidate, the largest first.
pub(super) fn largest_of_each<'r>(
    results: impl Iterator<Item = &'r ScreeningResult>,
    gain: impl Fn(&ScreeningResult) -> f64,
) -> Vec<ScreeningResult> {
    let mut best: Vec<ScreeningResult> = Vec::new();
    for result in results {
        match best.iter_mut().find(|b| b.candidate == result.candidate) {
            Some(known) if gain(result) > gain(known) => known.clone_from(result),
            Some(_) => {}
            None => best.push(result.clone()),
        }
    }
    best.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    best
}
