//! The warnings before an estimation, and what to do about them.
//!
//! The limits are those of the warnings of a finished run, so that `identify` gives the same ones earlier. Next file to read:
//! [`crate::warnings`].

use super::result::{DirectionInfo, Identification, ParameterInfo};
use super::words::listed;
use crate::Study;
use crate::warnings::{CORRELATED, UNINFORMED, correlated, uninformed_combination};

/// Collinearity index from which a set of parameters is hard to estimate together (Brun, Reichert & Künsch 2001).
const CRITICAL: f64 = 10.0;
/// At most this many pairs have a warning of their own.
const PAIRS: usize = 20;

/// All warnings: those of the study, parameters without effect, uninformed parameters and combinations, correlated pairs.
pub fn warnings(study: &Study, found: &Identification) -> Vec<String> {
    let mut warnings = study.warnings.clone();
    let silent =
        |name: &String| format!("{name} changes no observed prediction: these data cannot determine it.");
    warnings.extend(found.silent.iter().map(silent));
    warnings.extend(uninformed(found).map(|p| {
        format!(
            "these data say almost nothing about {}: its expected uncertainty is still {:.0} % of the prior's.",
            p.name,
            100.0 * p.expected_sd / p.prior_sd
        )
    }));
    warnings.extend(weak(found).map(|d| uninformed_combination(&d.combination, d.share)));
    let pairs = found.correlated_pairs();
    let name = |j: usize| &found.parameters[j].name;
    warnings.extend(pairs.iter().take(PAIRS).map(|(i, j, c)| correlated(name(*i), name(*j), *c)));
    if pairs.len() > PAIRS {
        warnings.push(format!("{} pairs more are correlated beyond {CORRELATED}.", pairs.len() - PAIRS));
    }
    warnings
}

impl Identification {
    /// Pairs of parameters (positions) that are correlated beyond 0.95 by the data alone, the strongest first.
    pub fn correlated_pairs(&self) -> Vec<(usize, usize, f64)> {
        let mut pairs = Vec::new();
        for (i, row) in self.correlation.iter().enumerate() {
            let later = row.iter().enumerate().skip(i + 1);
            pairs.extend(later.filter_map(|(j, c)| Some((i, j, c.filter(|c| c.abs() > CORRELATED)?))));
        }
        // Sorted by the digits that are printed: what differs by rounding only stays in the order of the parameters.
        pairs.sort_by_key(|(_, _, c)| std::cmp::Reverse((1000.0 * c.abs()).round() as i64));
        pairs
    }
}

/// Parameters that change a prediction but about which the data say almost nothing.
fn uninformed(found: &Identification) -> impl Iterator<Item = &ParameterInfo> {
    let keeps = |p: &&ParameterInfo| p.expected_sd > UNINFORMED * p.prior_sd;
    found.parameters.iter().filter(keeps).filter(|p| !found.silent.contains(&p.name))
}

/// Combinations about which the data say almost nothing although they inform some of their parameters.
fn weak(found: &Identification) -> impl Iterator<Item = &DirectionInfo> {
    let keeps = |name: &String| {
        found.parameters.iter().any(|p| p.name == *name && p.expected_sd > UNINFORMED * p.prior_sd)
    };
    found.directions.iter().filter(move |d| d.share > UNINFORMED && !d.parameters.iter().all(keeps))
}

/// What to do, in a sentence or two.
pub fn advice(found: &Identification) -> String {
    let mut said = Vec::new();
    if !found.silent.is_empty() {
        said.push(format!("Fix {} as a constant, or observe what depends on it.", listed(&found.silent)));
    }
    let in_weak = |name: &String| weak(found).any(|d| d.parameters.contains(name));
    let quiet: Vec<String> =
        uninformed(found).map(|p| p.name.clone()).filter(|name| !in_weak(name)).collect();
    if !quiet.is_empty() {
        said.push(format!(
            "Fix {}, or measure longer, more often or with less noise: its posterior will be its prior.",
            listed(&quiet)
        ));
    }
    said.extend(weak(found).map(|d| {
        format!(
            "Of {} fix one, give one a tighter prior, or measure what tells them apart: nothing here determines {}.",
            listed(&d.parameters),
            d.combination
        )
    }));
    if said.is_empty() {
        said.push(sound(found));
        said.extend(weakest(found));
    }
    said.extend(together(found));
    said.join(" ")
}

/// The advice where the data inform every parameter and combination.
fn sound(found: &Identification) -> String {
    let least = found.parameters.iter().min_by(|a, b| a.informed.total_cmp(&b.informed));
    let width = least.map_or(String::new(), |p| {
        format!(" (least of all {}, to {:.2} % of its prior sd)", p.name, 100.0 * p.expected_sd / p.prior_sd)
    });
    if found.correlated_pairs().is_empty() {
        return format!(
            "The estimation is reasonable: these data inform every parameter{width} and no pair is locked."
        );
    }
    format!(
        "These data inform every parameter{width}, but some of them only together: read the correlated pairs as one \
         combination each, or fix one of the two."
    )
}

/// The combination of several parameters that is known worst.
fn weakest(found: &Identification) -> Option<String> {
    let d = found.directions.iter().find(|d| d.parameters.len() > 1)?;
    Some(format!(
        "The weakest combination is {}, left with {:.2} % of its prior sd.",
        d.combination,
        100.0 * d.share
    ))
}

/// The largest set that can be estimated together, where the whole set cannot.
fn together(found: &Identification) -> Option<String> {
    let whole = &found.collinearity;
    if whole.index.is_some_and(|index| index < CRITICAL) {
        return None;
    }
    let fits = |subset: &&super::result::SubsetInfo| subset.index.is_some_and(|index| index < CRITICAL);
    let best = whole.growing.iter().filter(fits).max_by_key(|subset| subset.parameters.len())?;
    let left: Vec<String> =
        whole.parameters.iter().filter(|name| !best.parameters.contains(name)).cloned().collect();
    let rest = if left.len() < best.parameters.len() {
        format!("without {} it is", listed(&left))
    } else {
        format!("that of {} alone is", listed(&best.parameters))
    };
    Some(format!(
        "The collinearity index of the whole set is {}; {rest} {:.1}, below the critical {CRITICAL}.",
        whole.index.map_or_else(|| "beyond measure".to_owned(), |index| format!("{index:.1}")),
        best.index.unwrap_or(1.0)
    ))
}
