//! Observer, estimator, fleet and explain settings: words to choices, numbers to ranges.
//!
//! Next file to read: [`super::model`].

use starlings_estimators::{Points, Root};
use starlings_models::ObserverDef;
use toml::Spanned;

use crate::study::checked::{EstimatorChoice, EstimatorKind, ExplainChoice, FleetChoice, Library};
use crate::study::file::{EstimatorSection, FleetSection, ObserverSection, StudyFile};
use crate::study::problem::Source;

/// `[observer]`.
pub(in crate::study) fn observer(source: &Source, section: &ObserverSection) -> ObserverDef {
    let kind = section.kind.get_ref();
    let kinds: Vec<String> = starlings_models::observer::kinds().iter().map(|k| k.kind.to_owned()).collect();
    if !kinds.contains(kind) {
        source.report_unknown(section.kind.span(), format!("unknown observer `{kind}`"), &kinds);
    }
    let gain = *section.gain.get_ref();
    if gain < 0.0 {
        let message = format!("the observer's `gain` must not be negative, found {gain}");
        source.report_with(section.gain.span(), message, "0 switches the observer off");
    }
    let corrects = section.corrects.iter().map(|(o, s)| (o.get_ref().clone(), s.get_ref().clone())).collect();
    ObserverDef { kind: kind.clone(), gain, corrects }
}

/// `[estimator]`.
pub(in crate::study) fn estimator(source: &Source, section: &EstimatorSection) -> EstimatorChoice {
    let kinds = [("roukf", EstimatorKind::Roukf), ("batch", EstimatorKind::Batch)];
    let kind = choose(source, section.kind.as_ref(), "estimator", &kinds).unwrap_or(EstimatorKind::Roukf);
    let roots = [("symmetric", Root::Symmetric), ("cholesky", Root::Cholesky)];
    let resample = [("svd", true), ("none", false)];
    let default_spread = match kind {
        EstimatorKind::Roukf => 0.001,
        EstimatorKind::Batch => 0.1,
    };
    EstimatorChoice {
        kind,
        points: points(source, section),
        root: choose(source, section.root.as_ref(), "root", &roots).unwrap_or(Root::Symmetric),
        passes: at_least_one(source, section.passes.as_ref(), "passes").map_or(2, |n| n as usize),
        anneal: positive(source, section.anneal.as_ref(), "anneal", 10.0),
        spread: positive(source, section.spread.as_ref(), "spread", default_spread),
        resample: choose(source, section.resample.as_ref(), "resampling", &resample).unwrap_or(true),
        max_iterations: at_least_one(source, section.max_iterations.as_ref(), "max_iterations")
            .map_or(30, |n| n as usize),
        tolerance: positive(source, section.tolerance.as_ref(), "tolerance", 0.01),
    }
}

fn points(source: &Source, section: &EstimatorSection) -> Points {
    let kappa = section.kappa.as_ref().map_or(0.5, |k| *k.get_ref());
    let choices = [
        ("simplex", Points::Simplex),
        ("canonical", Points::Canonical),
        ("star", Points::Star),
        ("julier-uhlmann", Points::JulierUhlmann { kappa }),
    ];
    let points = choose(source, section.points.as_ref(), "sigma points", &choices).unwrap_or(Points::Simplex);
    if let Some(given) = &section.kappa {
        if !matches!(points, Points::JulierUhlmann { .. }) {
            let help = "remove it, or use points = \"julier-uhlmann\"";
            source.report_with(given.span(), "`kappa` belongs to julier-uhlmann points", help);
        } else if kappa <= 0.0 {
            let help = "the centre needs a positive weight; 0.5 weighs all points alike";
            source.report_with(given.span(), format!("`kappa` must be above zero, found {kappa}"), help);
        }
    }
    points
}

/// `[fleet]`.
pub(in crate::study) fn fleet(source: &Source, section: &FleetSection) -> FleetChoice {
    FleetChoice {
        workers: at_least_one(source, section.workers.as_ref(), "workers").map_or(2, |n| n as usize),
        slots: at_least_one(source, section.slots.as_ref(), "slots").map(|n| n as usize),
        patience: section.patience.as_ref().map(|p| positive(source, Some(p), "patience", 0.0)),
        max_attempts: at_least_one(source, section.max_attempts.as_ref(), "max_attempts")
            .map(|n| u32::try_from(n).unwrap_or(u32::MAX)),
    }
}

/// `[explain]`.
pub(in crate::study) fn explain(source: &Source, file: &StudyFile) -> ExplainChoice {
    let section = &file.explain;
    let libraries = [("all", Library::All), ("study", Library::Study), ("built-in", Library::BuiltIn)];
    ExplainChoice {
        hold_out_channels: section.hold_out_channels.iter().map(|c| c.get_ref().clone()).collect(),
        budget: section.budget,
        library: choose(source, section.library.as_ref(), "library", &libraries).unwrap_or_default(),
    }
}

/// The choice behind a word; an unknown word is reported.
fn choose<T: Copy>(
    source: &Source,
    word: Option<&Spanned<String>>,
    what: &str,
    choices: &[(&str, T)],
) -> Option<T> {
    let word = word?;
    let found = choices.iter().find(|(name, _)| name == word.get_ref()).map(|(_, choice)| *choice);
    if found.is_none() {
        let valid: Vec<String> = choices.iter().map(|(name, _)| (*name).to_owned()).collect();
        source.report_unknown(word.span(), format!("unknown {what} `{}`", word.get_ref()), &valid);
    }
    found
}

fn at_least_one(source: &Source, value: Option<&Spanned<u64>>, key: &str) -> Option<u64> {
    let value = value?;
    if *value.get_ref() == 0 {
        source.report(value.span(), format!("`{key}` must be at least 1, found 0"));
    }
    Some(*value.get_ref())
}

fn positive(source: &Source, value: Option<&Spanned<f64>>, key: &str, default: f64) -> f64 {
    let Some(value) = value else { return default };
    if *value.get_ref() <= 0.0 {
        source.report(value.span(), format!("`{key}` must be above zero, found {}", value.get_ref()));
    }
    *value.get_ref()
}
