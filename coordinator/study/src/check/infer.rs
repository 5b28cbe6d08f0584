//! A study as `infer` takes it: equations whose states are all measured, and what is unknown in them.
//!
//! Recordings are not read here: only which column is which state. Next file to read: [`self::records`].

mod candidates;
mod records;
mod reduced;
mod settings;

use std::path::Path;
use std::sync::Arc;

use starlings_models::equations::{Drift, EquationsDef};
use starlings_models::{Setup, SetupError, SumsDef, did_you_mean};
use toml::Spanned;

use super::built::CheckedModel;
use super::settings::{estimator, fleet};
use super::{check_name, model};
use crate::checked::Study;
use crate::file::StudyFile;
use crate::file::infer::InferSection;
use crate::file::read::read;
use crate::infer_choice::InferChoice;
use crate::problem::{Source, StudyError};
use crate::solver_host::SolverHost;

/// Checks the text of a study for an inference.
pub(super) fn study(path: &Path, text: &str) -> Result<Study, StudyError> {
    let source = Source::new(path, text);
    let host = SolverHost::default();
    let file = read(&source, host.adapters())?;
    source.verdict()?;
    check_name(&source, &file);
    let (fleet, estimator) = (fleet(&source, &file.fleet), estimator(&source, &file.estimator, None));
    let built = model::model(&source, &file, None);
    let infer = built.as_ref().and_then(|built| infer(&source, &file, &built.setup));
    source.verdict()?;
    let (Some(CheckedModel { setup, spec, candidates, delays, .. }), Some(infer)) = (built, infer) else {
        return Err(StudyError { problems: Vec::new() });
    };
    let mut study = super::study_of(path, &source, file, (setup, spec), (fleet, estimator), &host);
    (study.candidates, study.delays, study.infer) = (Arc::new(candidates), delays, Some(Arc::new(infer)));
    Ok(study)
}

/// What the file asks of its model; `None` where a problem was reported.
fn infer(source: &Source, file: &StudyFile, setup: &Setup) -> Option<InferChoice> {
    let Some(section) = &file.infer else {
        let end = source.text.len();
        let help = "add `[infer]` with `parameters = [...]`, `basis = \"polynomial\"` or `functions = [...]`";
        source.report_with(end..end, "the study does not say what to infer", help);
        return None;
    };
    let Some(equations) = &setup.model.equations else {
        let help = "an inference is made of states and rates that the study writes";
        let message = format!("`infer` needs `kind = \"equations\"`, found `{}`", setup.model.kind);
        source.report_with(file.model.kind.span(), message, help);
        return None;
    };
    let before = source.count();
    let mut sums = settings::sums(source, section);
    sums.candidates = candidates::functions(source, section.candidates.as_ref(), equations);
    sums.left = settings::left(source, section, equations, &sums.candidates);
    if source.count() > before {
        return None;
    }
    check_functions(source, section, equations, &setup.model.constants, &sums);
    let most_steps = settings::most_steps(equations);
    Some(InferChoice {
        priors: settings::priors(source, file, &sums),
        sums,
        diffusion: settings::diffusion(source, section),
        prefactor: section.prefactor.as_ref().is_none_or(|p| *p.get_ref()),
        measured: settings::measured(source, section),
        block: settings::block(source, section, most_steps),
        most_steps,
        breaks: settings::breaks(source, section),
        resample: section.resample.is_some(),
        reduced: section.reduced.as_ref().map(|reduced| reduced::reduced(source, reduced)),
        missing: candidates::missing(source, section.candidates.as_ref()),
        follow: settings::follow(source, section.follow.as_ref()),
        records: records::records(source, file, equations),
        held_out: section
            .candidates
            .iter()
            .flat_map(|_| records::held_out(source, file, equations))
            .collect(),
    })
}

/// Whether the rates are linear in the unknowns, and functions are known.
fn check_functions(
    source: &Source,
    section: &InferSection,
    equations: &EquationsDef,
    constants: &std::collections::BTreeMap<String, f64>,
    sums: &SumsDef,
) {
    let refused = if sums.unknown.is_empty() {
        Drift::of_texts(equations, constants, &sums.functions, &sums.left).err()
    } else {
        Drift::of_rates(equations, constants, &sums.unknown, &sums.left).err()
    };
    let candidates = || Drift::of_texts(equations, constants, &sums.candidates, &sums.left).err();
    if let Some(error) = refused.or_else(candidates) {
        let of_candidates = candidates::listed(section.candidates.as_ref());
        let listed = section.parameters.iter().chain(&section.functions).chain(of_candidates);
        match error {
            SetupError::Unknown { what, name, nearest } => {
                let span =
                    listed.clone().find(|p| *p.get_ref() == name).map_or(section.span.clone(), Spanned::span);
                let message = format!("no {what} is named `{name}`");
                match nearest {
                    Some(near) => source.report_with(span, message, did_you_mean(near)),
                    None => source.report_with(span, message, "name a parameter that a state's rate uses"),
                }
            }
            SetupError::Expression { place, expression, column, message } => {
                let function = listed.clone().find(|p| *p.get_ref() == expression).map(Spanned::span);
                let message = format!("in the {place} (`{expression}`, column {column}): {message}");
                // A function that the study writes has no coefficient inside.
                let help = if function.is_some() {
                    "a function reads states, inputs, outputs and constants"
                } else {
                    "coefficients are inferred where the rates are linear in them; give other parameters as constants"
                };
                source.report_with(function.unwrap_or(section.span.clone()), message, help);
            }
            other => source.report(section.span.clone(), other.to_string()),
        }
    }
}
