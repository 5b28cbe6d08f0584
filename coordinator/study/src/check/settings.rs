//! Observer, estimator and fleet settings: words to choices, numbers to ranges.
//!
//! Next file to read: [`super::model`].

use starlings_estimators::{BATCH, Batch, KINDS, Kind, Points, Root};
use starlings_models::{Description, ObserverDef};
use toml::Spanned;

use crate::checked::{EstimatorChoice, FleetChoice};
use crate::file::table::choose;
use crate::file::{EstimatorSection, FleetSection, ObserverSection};
use crate::problem::Source;

/// `[observer]`, or a list of them.
pub(crate) fn observer(
    source: &Source,
    section: &ObserverSection,
    solver: Option<&Description>,
) -> ObserverDef {
    for other in &section.beside {
        if let Some(solver) = solver {
            let message = format!("the solver `{}` hosts one observer at a time", solver.name);
            source.report_with(other.kind.span(), message, "write one `[observer]`");
        }
    }
    if !section.beside.is_empty() {
        let idle = |s: &&ObserverSection| s.kind.get_ref() == "none" || *s.gain.get_ref() <= 0.0;
        for one in section.all().filter(idle) {
            let message = "an observer of a list has a kind and a gain above zero";
            source.report_with(one.kind.span(), message, "remove it, or give both");
        }
    }
    let one = |section_of: &ObserverSection| {
        let def = one_observer(source, section_of, solver);
        let of_its_kind = section.all().filter(|other| *other.kind.get_ref() == def.kind).count();
        ObserverDef { named_only: of_its_kind > 1 && !def.corrects.is_empty(), ..def }
    };
    let beside = section.beside.iter().map(one).collect();
    ObserverDef { beside, ..one(section) }
}

fn one_observer(source: &Source, section: &ObserverSection, solver: Option<&Description>) -> ObserverDef {
    let kind = section.kind.get_ref();
    let known = || starlings_models::observer::kinds().iter().map(|k| k.kind.to_owned()).collect();
    let hosted = |solver: &Description| {
        std::iter::once("none".to_owned()).chain(solver.observers.iter().cloned()).collect::<Vec<String>>()
    };
    let kinds: Vec<String> = solver.map_or_else(known, hosted);
    if !kinds.contains(kind) {
        let message = match solver {
            Some(solver) => format!("the solver `{}` hosts no observer `{kind}`", solver.name),
            None => format!("unknown observer `{kind}`"),
        };
        source.report_unknown(section.kind.span(), message, &kinds);
    }
    let gain = *section.gain.get_ref();
    if gain < 0.0 {
        let message = format!("the observer's `gain` must not be negative, found {gain}");
        source.report_with(section.gain.span(), message, "0 switches the observer off");
    }
    let corrects = section.corrects.iter().map(|(o, s)| (o.get_ref().clone(), s.get_ref().clone())).collect();
    ObserverDef { kind: kind.clone(), gain, corrects, ..ObserverDef::default() }
}

/// `[estimator]`. A solver that cannot restart from a state has its records run as a whole.
pub(crate) fn estimator(
    source: &Source,
    section: &EstimatorSection,
    solver: Option<&Description>,
) -> EstimatorChoice {
    let kinds: Vec<(&str, &'static Kind)> = KINDS.iter().map(|kind| (kind.name, *kind)).collect();
    let once = solver.filter(|solver| !solver.spec.restart);
    let default = if once.is_some() { &BATCH } else { KINDS[0] };
    let kind = choose(source, section.kind.as_ref(), "estimator", &kinds).unwrap_or(default);
    if let (Some(solver), Some(given), true) = (once, &section.kind, kind.is_filter()) {
        let message = format!(
            "kind = \"{}\" goes on from the state of each analysis, and the solver `{}` cannot restart from a state",
            kind.name, solver.name
        );
        source.report_with(given.span(), message, "use kind = \"batch\", which runs whole records");
    }
    if let (Some(solver), Some(given), true) = (solver, &section.kind, kind.has_exact_slopes()) {
        let message = format!(
            "kind = \"{}\" wants derivatives, and the solver `{}` gives none",
            kind.name, solver.name
        );
        source.report_with(given.span(), message, "use kind = \"batch\", whose sigma points stand for them");
    }
    let roots = [("symmetric", Root::Symmetric), ("cholesky", Root::Cholesky)];
    let resample = [("svd", true), ("none", false)];
    foreign_keys(source, section, kind, once);
    EstimatorChoice {
        kind,
        points: points(source, section),
        root: choose(source, section.root.as_ref(), "root", &roots).unwrap_or(Root::Symmetric),
        passes: counted(source, section.passes.as_ref(), "passes", 1000),
        anneal: anneal(source, section.anneal.as_ref()),
        spread: positive(source, section.spread.as_ref(), "spread", kind.spread),
        resample: choose(source, section.resample.as_ref(), "resampling", &resample).unwrap_or(true),
        max_iterations: counted(source, section.max_iterations.as_ref(), "max_iterations", 100_000)
            .unwrap_or(Batch::MAX_ITERATIONS),
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
pub(crate) fn fleet(source: &Source, section: &FleetSection) -> FleetChoice {
    FleetChoice {
        workers: counted(source, section.workers.as_ref(), "workers", 1024).unwrap_or(2),
        slots: counted(source, section.slots.as_ref(), "slots", 4096),
        patience: section.patience.as_ref().map(|p| patience(source, p)),
        max_attempts: counted(source, section.max_attempts.as_ref(), "max_attempts", 1000).map(|n| n as u32),
        timeout_factor: section.timeout_factor.as_ref().and_then(|f| timeout_factor(source, f)),
    }
}

/// How many times the usual time a run may take: a factor that ends ordinary runs is a mistake.
fn timeout_factor(source: &Source, given: &Spanned<f64>) -> Option<f64> {
    let factor = *given.get_ref();
    if (2.0..=1e6).contains(&factor) {
        return Some(factor);
    }
    let help = "20 ends a run that takes twenty times as long as runs usually do";
    source.report_with(given.span(), format!("`timeout_factor` must be from 2 to 1e6, found {factor}"), help);
    None
}

/// A count from 1 to `most`.
pub(super) fn counted(source: &Source, value: Option<&Spanned<u64>>, key: &str, most: u64) -> Option<usize> {
    let value = value?;
    let n = *value.get_ref();
    if n == 0 || n > most {
        let expected = if n == 0 { "at least 1".to_owned() } else { format!("at most {most}") };
        source.report(value.span(), format!("`{key}` must be {expected}, found {n}"));
    }
    Some(n.clamp(1, most) as usize)
}

/// A factor on the noise of the first pass; below 1 it would sharpen it.
fn anneal(source: &Source, value: Option<&Spanned<f64>>) -> f64 {
    let Some(value) = value else { return 10.0 };
    let factor = *value.get_ref();
    if !(1.0..=1e9).contains(&factor) {
        source.report(value.span(), format!("`anneal` must be from 1 to 1e9, found {factor}"));
    }
    factor
}

/// Seconds, at most a hundred years.
fn patience(source: &Source, value: &Spanned<f64>) -> f64 {
    let seconds = *value.get_ref();
    if !(seconds > 0.0 && seconds <= 3.2e9) {
        source.report(
            value.span(),
            format!("`patience` must be above zero and at most 3.2e9 s, found {seconds}"),
        );
        return 1.0;
    }
    seconds
}

/// Keys that belong to other estimators than the chosen one: they would be ignored silently.
fn foreign_keys(source: &Source, section: &EstimatorSection, kind: &Kind, once: Option<&Description>) {
    let given = [
        ("points", section.points.as_ref().map(Spanned::span)),
        ("kappa", section.kappa.as_ref().map(Spanned::span)),
        ("spread", section.spread.as_ref().map(Spanned::span)),
        ("passes", section.passes.as_ref().map(Spanned::span)),
        ("anneal", section.anneal.as_ref().map(Spanned::span)),
        ("root", section.root.as_ref().map(Spanned::span)),
        ("resample", section.resample.as_ref().map(Spanned::span)),
        ("max_iterations", section.max_iterations.as_ref().map(Spanned::span)),
        ("tolerance", section.tolerance.as_ref().map(Spanned::span)),
    ];
    for (key, span) in given {
        let owners: Vec<&&Kind> = KINDS.iter().filter(|other| other.keys.contains(&key)).collect();
        // Those that go through the data in the same way, where there are such.
        let alike = owners.iter().any(|other| other.is_filter() == kind.is_filter());
        let names = owners.iter().filter(|other| !alike || other.is_filter() == kind.is_filter());
        let names = names.map(|other| format!("\"{}\"", other.name)).collect::<Vec<_>>().join(" or ");
        if let (Some(span), false, false) = (span, names.is_empty(), kind.keys.contains(&key)) {
            let help = match once {
                Some(solver) => {
                    format!("remove it: the solver `{}` cannot restart from a state", solver.name)
                }
                None => format!("remove it, or use kind = {names}"),
            };
            source.report_with(span, format!("`{key}` belongs to kind = {names}"), help);
        }
    }
}

fn positive(source: &Source, value: Option<&Spanned<f64>>, key: &str, default: f64) -> f64 {
    let Some(value) = value else { return default };
    if *value.get_ref() <= 0.0 {
        source.report(value.span(), format!("`{key}` must be above zero, found {}", value.get_ref()));
    }
    *value.get_ref()
}
