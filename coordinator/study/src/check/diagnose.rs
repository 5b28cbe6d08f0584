//! A study as `diagnose` takes it: the file as it is, and once more for every scenario with what that changes.
//!
//! A scenario's parts take their places among the sections of the file with the places where they are written, so that every check of
//! a study is one of a scenario too, and tells of it where it stands. Next file to read: [`super`].

use std::path::Path;

use toml::Spanned;

use super::checked;
use super::load::Purpose;
use crate::checked::Study;
use crate::diagnosis::{Diagnosis, Scenario};
use crate::file::diagnose::{DiagnoseSection, ScenarioSection};
use crate::file::read::read;
use crate::file::{Outliers, StudyFile};
use crate::problem::{Source, StudyError};
use crate::solver_host::SolverHost;

/// Rate of false alarms where the study does not say.
const FALSE_ALARM: f64 = 0.01;
/// Starts of one scenario at most.
const MOST_STARTS: usize = 10_000;

/// Checks the text of a study for a diagnosis.
pub(super) fn diagnosis(path: &Path, text: &str, host: &SolverHost) -> Result<Diagnosis, StudyError> {
    let source = Source::new(path, text);
    let mut file = read(&source, host.adapters())?;
    source.verdict()?;
    let Some(section) = file.diagnose.take() else {
        let end = source.text.len();
        let help = "add `[[diagnose.scenarios]]` with a `name` and `parameters`, the severity first";
        source.report_with(end..end, "the study does not say what a fault may be", help);
        return Err(source.verdict().err().unwrap_or(StudyError { problems: Vec::new() }));
    };
    check_section(&source, &section);
    source.verdict()?;
    file.needs_parameter = false;
    keep_outliers(&mut file);
    let healthy = checked(path, &source, file, (host, Purpose::Runs))?;
    let scenario = |at| scenario(path, text, at, &healthy, host);
    let scenarios = (0..section.scenarios.len()).map(scenario).collect::<Result<_, _>>()?;
    let false_alarm = section.false_alarm.map_or(FALSE_ALARM, Spanned::into_inner);
    Ok(Diagnosis { healthy, scenarios, false_alarm })
}

fn check_section(source: &Source, section: &DiagnoseSection) {
    if let Some(rate) = section
        .false_alarm
        .as_ref()
        .filter(|rate| !(0.0..=0.5).contains(rate.get_ref()) || *rate.get_ref() <= 0.0)
    {
        let message = format!("`false_alarm` must be above 0 and at most 0.5, found {}", rate.get_ref());
        source.report_with(
            rate.span(),
            message,
            "0.01 means: one recording without a fault in a hundred raises an alarm",
        );
    }
    if section.scenarios.is_empty() {
        let help = "add `[[diagnose.scenarios]]` with a `name` and `parameters`, the severity first";
        source.report_with(section.span.clone(), "the library of scenarios is empty", help);
    }
    for (k, scenario) in section.scenarios.iter().enumerate() {
        if section.scenarios[..k].iter().any(|other| other.name.get_ref() == scenario.name.get_ref()) {
            let message = format!("two scenarios are named `{}`", scenario.name.get_ref());
            source.report_with(scenario.name.span(), message, "names of scenarios are unique in a study");
        }
        check_scenario(source, scenario);
    }
}

fn check_scenario(source: &Source, scenario: &ScenarioSection) {
    let name = scenario.name.get_ref();
    if scenario.parameters.is_empty() {
        let message = format!("scenario `{name}` has no parameter");
        source.report_with(scenario.span.clone(), message, "give its severity with a prior");
    }
    for parameter in scenario.parameters.iter().filter(|p| p.per_record == Some(true)) {
        let message =
            format!("`{}` of scenario `{name}` is one value for all records", parameter.name.get_ref());
        source.report_with(parameter.name.span(), message, "remove `per_record`");
    }
    if let Some(weight) = scenario.weight.as_ref().filter(|weight| *weight.get_ref() <= 0.0) {
        let message = format!("`weight` must be above zero, found {}", weight.get_ref());
        source.report_with(
            weight.span(),
            message,
            "2 means: twice as likely beforehand as a scenario without it",
        );
    }
    let known: Vec<String> = scenario.parameters.iter().map(|p| p.name.get_ref().clone()).collect();
    for (key, values) in &scenario.grid {
        if !known.contains(key.get_ref()) {
            let message = format!("scenario `{name}` has no parameter `{}`", key.get_ref());
            source.report_unknown(key.span(), message, &known);
        }
        if values.is_empty() {
            let message = format!("`{}` of the grid has no value", key.get_ref());
            source.report_with(key.span(), message, "give a list of values from which to start");
        }
    }
    let n: usize = scenario.grid.iter().map(|(_, values)| values.len()).product();
    if n > MOST_STARTS {
        let message = format!("the grid of scenario `{name}` has {n} points, {MOST_STARTS} are the most");
        source.report_with(scenario.span.clone(), message, "each of them is a run of every record");
    }
}

/// One scenario as a study.
fn scenario(
    path: &Path,
    text: &str,
    at: usize,
    healthy: &Study,
    host: &SolverHost,
) -> Result<Scenario, StudyError> {
    let source = Source::new(path, text);
    let mut file = read(&source, host.adapters())?;
    let Some(section) = file.diagnose.take() else { return Err(StudyError { problems: Vec::new() }) };
    let Some(mut section) = section.scenarios.into_iter().nth(at) else {
        return Err(StudyError { problems: Vec::new() });
    };
    let grid = std::mem::take(&mut section.grid);
    let (name, says) = (section.name.get_ref().clone(), std::mem::take(&mut section.says));
    let weight = section.weight.take().map_or(1.0, Spanned::into_inner);
    enter(&mut file, section);
    keep_outliers(&mut file);
    let mut study = checked(path, &source, file, (host, Purpose::Runs))?;
    let grid = grid.into_iter().filter_map(|starts| starts_of(&source, &study, starts)).collect();
    source.verdict()?;
    study.warnings.retain(|warning| !healthy.warnings.contains(warning));
    Ok(Scenario { name, says, weight, study, grid })
}

/// A value that stands apart may be the fault that is looked for.
fn keep_outliers(file: &mut StudyFile) {
    for channel in file.records.iter_mut().flat_map(|record| &mut record.channels) {
        let at = channel.column.span();
        channel.outliers.get_or_insert(Spanned::new(at, Outliers::Keep));
    }
}

/// Puts what a scenario has in the place of what the study has.
fn enter(file: &mut StudyFile, scenario: ScenarioSection) {
    let replaced = |name: &str| {
        scenario.parameters.iter().any(|p| p.name.get_ref() == name)
            || scenario.set.iter().any(|(key, _)| key.get_ref() == name)
    };
    file.model.constants.retain(|(name, _)| !replaced(name.get_ref()));
    for record in &mut file.records {
        for (input, column) in &scenario.inputs {
            record.inputs.retain(|(known, _)| known.get_ref() != input.get_ref());
            record.inputs.push((input.clone(), column.clone()));
        }
    }
    file.model.constants.extend(scenario.set);
    file.parameters.extend(scenario.parameters);
}

/// The values of a grid by the parameter's index; `None` where a problem was reported.
fn starts_of(
    source: &Source,
    study: &Study,
    (key, values): (Spanned<String>, Vec<Spanned<f64>>),
) -> Option<(usize, Vec<f64>)> {
    let at = study.theta.iter().position(|entry| entry.name == *key.get_ref())?;
    let transform = study.theta[at].transform;
    for value in values.iter().filter(|value| !transform.contains(*value.get_ref())) {
        let message =
            format!("`{}` cannot start at {}: its prior excludes that", key.get_ref(), value.get_ref());
        source.report_with(value.span(), message, "give values inside the prior's bounds");
    }
    Some((at, values.into_iter().map(Spanned::into_inner).collect()))
}
