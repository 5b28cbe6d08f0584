//! Settings of an inference: words to choices, numbers to ranges, what excludes one another.
//!
//! Next file to read: [`crate::infer_choice`].

use starlings_estimators::Transform;
use starlings_models::equations::EquationsDef;
use starlings_models::{PolynomialDef, SumsDef};
use toml::Spanned;

use crate::check::prior;
use crate::check::settings::counted;
use crate::file::StudyFile;
use crate::file::infer::{FollowSection, InferSection, Rules, WordOrNumber};
use crate::file::table::choose;
use crate::infer_choice::{DiffusionChoice, FollowChoice, MeasuredChoice};
use crate::problem::Source;

/// Steps that the recording is thinned to against the error of the step: h, 2h and 4h.
const RICHARDSON_LEVELS: u32 = 3;
/// Numbers of a block at most: its rows travel in one message.
const MOST_NUMBERS: usize = 1 << 20;
/// Largest degree of a polynomial.
const MOST_DEGREE: u64 = 8;

/// The functions that are asked for.
pub(super) fn sums(source: &Source, section: &InferSection) -> SumsDef {
    let unknown: Vec<String> = section.parameters.iter().map(|p| p.get_ref().clone()).collect();
    for (i, name) in section.parameters.iter().enumerate() {
        if unknown[..i].contains(name.get_ref()) {
            source.report_with(
                name.span(),
                format!("`{}` is given twice", name.get_ref()),
                "remove one of the two",
            );
        }
    }
    let basis = choose(source, section.basis.as_ref(), "basis", &[("polynomial", ())]);
    let free = section.basis.as_ref().map(Spanned::span).or(section.functions.first().map(Spanned::span));
    if let (Some(span), false) = (free.clone(), unknown.is_empty()) {
        let message = "`parameters` asks for coefficients of the model's own rates, and `basis` and `functions` for others";
        source.report_with(span, message, "keep `parameters`, or `basis` and `functions`");
    }
    if free.is_none() && unknown.is_empty() {
        let help = "give `parameters = [...]`, `basis = \"polynomial\"` or `functions = [...]`";
        source.report_with(section.span.clone(), "[infer] asks for nothing", help);
    }
    for (key, span) in [
        ("degree", section.degree.as_ref().map(Spanned::span)),
        ("constant", section.constant.as_ref().map(Spanned::span)),
    ] {
        if let (Some(span), None) = (span, &section.basis) {
            source.report_with(
                span,
                format!("`{key}` belongs to `basis = \"polynomial\"`"),
                "remove it, or give the basis",
            );
        }
    }
    let degree = counted(source, section.degree.as_ref(), "degree", MOST_DEGREE).unwrap_or(2) as u32;
    let constant = section.constant.as_ref().is_some_and(|c| *c.get_ref());
    SumsDef {
        unknown,
        polynomial: basis.map(|()| PolynomialDef { degree, constant }),
        functions: section.functions.iter().map(|f| f.get_ref().clone()).collect(),
        left: Vec::new(),
        step: step(source, section),
        levels: if section.richardson.as_ref().is_some_and(|r| *r.get_ref()) { RICHARDSON_LEVELS } else { 1 },
        pairs: None,
        files: Vec::new(),
        candidates: Vec::new(),
    }
}

fn step(source: &Source, section: &InferSection) -> f64 {
    if let (Some(_), Some(resample)) = (&section.step, &section.resample) {
        let message = "`step` is that of the rows as they are, and `resample` makes another";
        source.report_with(resample.span(), message, "remove one of the two");
    }
    let (name, given) = match &section.resample {
        Some(step) => ("resample", Some(step)),
        None => ("step", section.step.as_ref()),
    };
    let Some(step) = given else { return 0.0 };
    if *step.get_ref() <= 0.0 {
        source.report(step.span(), format!("`{name}` must be above zero, found {}", step.get_ref()));
    }
    *step.get_ref()
}

/// What is taken at the start of a step: all states, or what is named.
pub(super) fn left(
    source: &Source,
    section: &InferSection,
    equations: &EquationsDef,
    candidates: &[String],
) -> Vec<String> {
    let rules = [("midpoint", false), ("ito", true)];
    let states: Vec<String> = equations.states.iter().map(|state| state.name.clone()).collect();
    match &section.rule {
        Rules::All(word) => {
            let ito = choose(source, word.as_ref(), "rule", &rules).unwrap_or(false);
            let functions = section.functions.iter().map(|f| f.get_ref().clone());
            let all = states.into_iter().chain(functions).chain(candidates.iter().cloned());
            if ito { all.collect() } else { Vec::new() }
        }
        Rules::ByName(named) => {
            let listed = section.parameters.iter().chain(&section.functions).map(|p| p.get_ref().clone());
            let of_rates = if section.parameters.is_empty() { Vec::new() } else { states };
            let known: Vec<String> = of_rates.into_iter().chain(listed).collect();
            let mut left = Vec::new();
            for (name, word) in named {
                if !known.contains(name.get_ref()) {
                    let message = format!(
                        "`rule` names `{}`, which is neither an equation nor a coefficient",
                        name.get_ref()
                    );
                    source.report_unknown(name.span(), message, &known);
                }
                if choose(source, Some(word), "rule", &rules).unwrap_or(false) {
                    left.push(name.get_ref().clone());
                }
            }
            left
        }
    }
}

/// The form of the noise.
pub(super) fn diffusion(source: &Source, section: &InferSection) -> DiffusionChoice {
    let forms = [
        ("full", DiffusionChoice::Full),
        ("diagonal", DiffusionChoice::Diagonal),
        ("isotropic", DiffusionChoice::Isotropic),
    ];
    choose(source, section.diffusion.as_ref(), "diffusion", &forms).unwrap_or_default()
}

/// What is known of the errors of the measurement.
pub(super) fn measured(source: &Source, section: &InferSection) -> MeasuredChoice {
    let Some(given) = &section.measurement_noise else { return MeasuredChoice::default() };
    match given.get_ref() {
        WordOrNumber::Word(word) => {
            let words = [("none", MeasuredChoice::None), ("auto", MeasuredChoice::Auto)];
            let word = Spanned::new(given.span(), word.clone());
            choose(source, Some(&word), "measurement noise", &words).unwrap_or_default()
        }
        WordOrNumber::Number(sd) if *sd > 0.0 => MeasuredChoice::Known(*sd),
        WordOrNumber::Number(sd) => {
            let message = format!("`measurement_noise` must be a standard deviation above zero, found {sd}");
            source.report_with(given.span(), message, "\"none\" says that there is none");
            MeasuredChoice::None
        }
    }
}

/// Steps of a block at most: its rows travel in one message.
pub(super) fn most_steps(equations: &EquationsDef) -> usize {
    let width = 1 + equations.states.len() + equations.inputs.len();
    (MOST_NUMBERS / width).max(256)
}

/// Steps of a block where the study says it.
pub(super) fn block(source: &Source, section: &InferSection, most: usize) -> Option<usize> {
    counted(source, section.block.as_ref(), "block", most as u64)
}

/// Whether a recording goes on where rows are missing.
pub(super) fn breaks(source: &Source, section: &InferSection) -> bool {
    choose(source, section.gaps.as_ref(), "gaps", &[("refuse", false), ("break", true)]).unwrap_or(false)
}

/// Priors of coefficients: Gaussian in the coefficient itself, or the posterior is no formula.
pub(super) fn priors(source: &Source, file: &StudyFile, sums: &SumsDef) -> Vec<(String, f64, f64)> {
    let mut priors = Vec::new();
    for parameter in &file.parameters {
        let name = parameter.name.get_ref();
        if !sums.unknown.contains(name) {
            let help = "name it in `[infer] parameters`, or give it as a constant and remove the prior";
            source.report_with(
                parameter.name.span(),
                format!("`{name}` has a prior and is not inferred"),
                help,
            );
            continue;
        }
        let Some(found) = prior::prior(source, parameter, None) else { continue };
        match (found.transform, found.mean) {
            (Transform::Linear, Some(mean)) => priors.push((name.clone(), mean, found.sd)),
            (Transform::Linear, None) => {
                let message = format!("the prior of `{name}` needs a `median`");
                source.report(parameter.prior.span.clone(), message);
            }
            (other, _) => {
                let message = format!(
                    "the prior of `{name}` is Gaussian under {}, and an inference needs one that is Gaussian in `{name}`",
                    other.name()
                );
                source.report_with(
                    parameter.prior.span.clone(),
                    message,
                    "use transform = \"linear\" with `median` and `sd`, or remove the prior",
                );
            }
        }
    }
    priors
}

/// `[infer.follow]`.
pub(super) fn follow(source: &Source, section: Option<&FollowSection>) -> FollowChoice {
    let usual = FollowChoice::default();
    let Some(section) = section else { return usual };
    let count = |value: &Option<Spanned<u64>>, key| counted(source, value.as_ref(), key, 1 << 32);
    if let Some(rate) = section.rate.as_ref().filter(|rate| !(1e-15..0.5).contains(rate.get_ref())) {
        let message = format!("`rate` must be a probability from 1e-15 to 0.5, found {}", rate.get_ref());
        source.report_with(rate.span(), message, "1e-6 is a false alarm in a million tests");
    }
    FollowChoice {
        block: count(&section.block, "block").unwrap_or(usual.block),
        recent: count(&section.recent, "recent").unwrap_or(usual.recent),
        window: count(&section.window, "window"),
        least: count(&section.least, "least").unwrap_or(usual.least),
        rate: section.rate.as_ref().map_or(usual.rate, |rate| *rate.get_ref()),
    }
}
