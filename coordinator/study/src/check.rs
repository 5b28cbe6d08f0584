//! Checks a study file and makes a [`Study`] of it: names against the model, numbers for plausibility, recordings for both.
//!
//! Checks go on after a fault as long as their answer can be trusted, so that one call reports as much as possible. Next file
//! to read: [`self::model`].

mod blame;
mod built;
mod defs;
mod diagnose;
mod explain;
mod infer;
mod initial;
mod limits;
mod load;
mod median;
mod model;
mod nudged;
mod observer;
mod parameters;
mod periodic;
mod predict;
mod prior;
mod records;
pub(crate) mod relative;
pub(crate) mod scales;
mod settings;
mod slopes;
mod solver;
mod spectrum;
mod survey;
mod together;
mod units;
mod walks;

use std::path::Path;
use std::sync::Arc;

use starlings_models::{BuildSetup, Setup, Spec};

use self::load::Purpose;
use self::parameters::initial_medians;
use self::records::records;
use self::settings::{estimator, fleet};
use self::solver::DescribedSolver;
pub(crate) use self::solver::UNTRIED;
use super::checked::{
    EstimatorChoice, ExplainChoice, FleetChoice, PredictChoice, Record, Rounding, SpectrumChoice, Study,
};
use super::expand;
use super::file::StudyFile;
use super::problem::{Source, StudyError};
use super::solver_host::SolverHost;
use crate::file::read::read;

/// Why a fit of a stochastic model says less than it seems to.
const NOISE_LEFT_OUT: &str = "the states' `noise` is left out of the runs of a fit, whose particles follow the rate alone: what the noise \
    did to the recording counts as noise of the channels";

fn check(path: &Path, text: &str, by: (&SolverHost, Purpose)) -> Result<Study, StudyError> {
    let source = Source::new(path, text);
    let file = read(&source, by.0.adapters())?;
    if source.count() > 0 {
        // After a fault of form other checks could be misleading; priors and data files can still be checked.
        survey::survey(&source, &file);
        source.verdict()?;
    }
    checked(path, &source, file, by)
}

/// Checks a file that was read without a fault of form.
fn checked(
    path: &Path,
    source: &Source,
    file: StudyFile,
    (solver_host, purpose): (&SolverHost, Purpose),
) -> Result<Study, StudyError> {
    check_name(source, &file);
    let solver = solver::solver(source, &file, solver_host);
    let described = solver.as_ref().and_then(DescribedSolver::description);
    let estimator = estimator(source, &file.estimator, described);
    let fleet = fleet(source, &file.fleet);
    let explain = explain::explain(source, &file);
    let observer = settings::observer(source, &file.observer, described);
    let spectrum = spectrum::spectrum(source, &file.spectrum, &observer);
    let model = model::model(source, &file, solver.as_ref());
    // Everything that follows is judged against the model.
    let Some(mut model) = model else { return Err(survey::without_model(source, &file)) };
    model.setup.observer = observer;
    explain::check_names(source, &file, &model.setup.model);
    let mut warnings = solver::check(source, &file, solver.as_ref());
    let relative: Vec<String> = relative::relative(&model.setup.effects).map(|p| p.name.clone()).collect();
    model::check_values(source, &file, &model, &|name| !relative.iter().any(|known| known == name));
    let initial = initial::constants(source, &file, &model.spec, &mut warnings);
    model.setup.model.constants.extend(initial);
    let priors = parameters::priors(source, &file, &model, &mut warnings);
    let records = records(source, &file, &mut model, &explain.hold_out_channels, &mut warnings);
    explain::check_held_out(source, &file, &records);
    let predict = predict::predict(source, &file.predict, &model.spec, &records);
    source.verdict()?;
    model.setup.parameters = file.parameters.iter().map(|p| p.name.get_ref().clone()).collect();
    let parameters = initial_medians(source, &file, &model.spec, &priors, &records);
    source.verdict()?;
    scales::check(source, &file, &mut model, (&parameters, &records), solver_host, &mut warnings);
    source.verdict()?;
    model.setup.periods = periodic::periods(source, &file, &model, &records, &mut warnings);
    source.verdict()?;
    check_setup(source, &file, &model.setup, &records)?;
    warnings.extend(model.setup.is_noisy().then(|| NOISE_LEFT_OUT.to_owned()));
    let (units, candidate_warnings) = units::warnings(&file, &model, &records);
    warnings.extend(units);
    let theta = expand::theta(&parameters, &records);
    let (kind, observers) = (slopes::place(&file.estimator), file.observer.clone());
    let (processes, predicted) = (walks::places(&file), file.predict.span.clone());
    let study = Study {
        candidates: Arc::new(model.candidates),
        parameters,
        theta,
        records: Arc::new(records),
        explain,
        spectrum,
        predict,
        delays: model.delays,
        runs_here: solver.is_none_or(|known| known.is_here),
        warnings,
        candidate_warnings,
        ..study_of(path, source, file, (model.setup, model.spec), (fleet, estimator), solver_host)
    };
    slopes::check(source, kind, &study);
    walks::check(source, &processes, predicted, &study);
    nudged::check(source, &observers, &study);
    together::check(source, &observers, &study, purpose);
    source.verdict()?;
    Ok(study)
}

/// A study of a model, without parameters, records and what commands ask of it.
fn study_of(
    path: &Path,
    source: &Source,
    file: StudyFile,
    (setup, spec): (Setup, Spec),
    (fleet, estimator): (FleetChoice, EstimatorChoice),
    solver_host: &SolverHost,
) -> Study {
    Study {
        file: path.to_owned(),
        text: Arc::clone(&source.text),
        name: file.study.name.into_inner(),
        says: file.study.says,
        seed: file.study.seed,
        time_unit: file.study.time_unit,
        setup,
        spec,
        candidates: Arc::default(),
        parameters: Vec::new(),
        theta: Vec::new(),
        records: Arc::default(),
        estimator,
        fleet,
        explain: ExplainChoice::default(),
        spectrum: SpectrumChoice::default(),
        predict: PredictChoice::default(),
        infer: None,
        delays: false,
        runs_here: true,
        whole_answers: false,
        rounding: Rounding { is_spread_given: file.estimator.spread.is_some(), ..Rounding::default() },
        solver_host: solver_host.clone(),
        warnings: Vec::new(),
        candidate_warnings: Vec::new(),
    }
}

/// Checks that need the finished setup: whether it builds, what a run of it costs, whether its observer fits.
fn check_setup(
    source: &Source,
    file: &StudyFile,
    setup: &Setup,
    records: &[Record],
) -> Result<(), StudyError> {
    model::check_build(source, file, setup);
    source.verdict()?;
    limits::check_delays(source, file, setup, records);
    observer::check(source, file, setup, records);
    source.verdict()
}

/// Checks the study's name, which becomes the name of a folder.
fn check_name(source: &Source, file: &StudyFile) {
    let name = file.study.name.get_ref();
    if name.is_empty()
        || name.starts_with('.')
        || name.contains(['/', '\\', ':'])
        || name.contains(char::is_control)
    {
        source.report_with(
            file.study.name.span(),
            format!("`{name}` cannot name a study: its run folder takes the name"),
            "use letters, digits, `-` and `_`",
        );
    }
}
