//! `starlings check`: validate everything, make one trial run, say what a run would do.

use std::path::PathBuf;

use clap::Parser;
use serde_json::json;
use starlings_coordinator::fleet::{PlaceName, RunIdentity, StateStore};
use starlings_coordinator::study::MAX_PASSES;
use starlings_coordinator::study::field::{field_of, observed_fields};
use starlings_coordinator::study::trial::{Depth, TrialChannel, dry_run};
use starlings_coordinator::study::{Study, posterior};
use starlings_estimators::{Form, SigmaSet, Slope};

use crate::console::{line, number, table, text};
use crate::disk;
use crate::failure::Failure;
use crate::load::load;

/// Validate a study, its recordings and its model, and make one trial run at the prior median.
///
/// A study with a section `[infer]` is checked as `starlings infer` takes it: what is asked of which equations, and the first rows of its
/// recordings. One with a section `[diagnose]` is checked with each of its scenarios in turn.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Print what was found as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Folder for large states that `run --states` would share with workers: whether it takes them.
    #[arg(long, value_name = "FOLDER")]
    states: Option<PlaceName>,
}

/// Checks the study.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if Study::asks_to_infer(&args.study) {
        return crate::infer::check_only(&args.study, args.json);
    }
    if Study::asks_to_diagnose(&args.study) {
        return crate::diagnose::check_only(&args.study, args.json);
    }
    let mut study = load(&args.study)?;
    let kind = study.estimator.kind;
    let channels = dry_run(&mut study, kind, Depth::All).map_err(Failure::input)?;
    let ensemble = ensemble(&study)?;
    if let Some(place) = &args.states {
        check_place(&study, place)?;
    }
    if args.json {
        line(format_args!("{:#}", as_json(&study, &channels, ensemble)))
    } else {
        print(&study, &channels, ensemble)
    }
}

/// Whether a folder takes the states of a study: that it can be written, and has the room. What is tried leaves nothing.
fn check_place(study: &Study, place: &PlaceName) -> Result<(), Failure> {
    let folder = place.of_run(&RunIdentity::new().id).passing();
    StateStore::shared(folder).keep(&[1.0]).map_err(Failure::input)?;
    disk::check_states(study, Some(&place.to_string()), false)
}

/// What becomes of states that are too large for messages; `None` where they are small.
fn states_text(study: &Study) -> Option<String> {
    let all = study.bytes_of_states();
    study.has_large_states().then(|| {
        format!(
            "a state has {}: states travel beside the messages, and a step holds {} of them, in --state-memory and then on the \
             disk, or in the folder of --states",
            disk::size(8 * study.spec.n_state() as u64),
            disk::size(3 * all)
        )
    })
}

/// Particles of one ensemble, and whether a filter draws them again at every analysis.
fn ensemble(study: &Study) -> Result<(usize, bool), Failure> {
    let ensemble = match study.estimator.kind.form {
        Form::Windows(make) => make(&study.filter_options()).map(|f| (f.n_particle(), f.resamples())),
        Form::WholeRecords(Slope::Exact) => Ok((1, false)),
        Form::WholeRecords(Slope::Points) => {
            SigmaSet::new(study.estimator.points, study.theta.len()).map(|set| (set.n_particle(), false))
        }
    };
    ensemble.map_err(Failure::input)
}

/// Runs of one pass of the filter, or of one ensemble of the batch fit.
fn runs_per_pass(study: &Study, (n_particle, resamples): (usize, bool)) -> usize {
    let windows: Vec<usize> = (0..study.records.len()).map(|r| study.windows(r).len()).collect();
    if !study.estimator.kind.is_filter() {
        // The centre is run beside the sigma points, and alone where it gives the slopes.
        let of_record = if study.estimator.kind.has_exact_slopes() { 1 } else { n_particle + 1 };
        return of_record * windows.iter().filter(|n| **n > 0).count();
    }
    // Redrawn points are observed by runs of their own.
    let redrawn = study.estimator.resample && resamples && study.observer_is_off();
    n_particle * windows.iter().sum::<usize>() * if redrawn { 2 } else { 1 }
}

/// Passes of the filter at least and at most; none of the batch fit.
fn passes(study: &Study) -> Option<(usize, usize)> {
    let of_filter = study.estimator.kind.is_filter();
    of_filter.then(|| study.passes().map_or((2, MAX_PASSES), |n| (n, n)))
}

fn as_json(study: &Study, channels: &[TrialChannel], ensemble: (usize, bool)) -> serde_json::Value {
    let estimates = posterior::estimates(study, &posterior::prior(study));
    json!({
        "study": study.name,
        "model": study.setup.model.kind,
        "estimator": study.describe_estimator(),
        "parameters": estimates.iter().map(|e| json!({
            "name": e.name, "unit": e.unit, "prior_median": e.prior_median, "prior_interval95": e.prior_interval95,
        })).collect::<Vec<_>>(),
        "particles": ensemble.0,
        "runs_per_pass": runs_per_pass(study, ensemble),
        "state_bytes": 8 * study.spec.n_state(),
        "passes": passes(study).map(|(least, most)| json!({ "at_least": least, "at_most": most })),
        "trial": channels.iter().map(|c| json!({
            "record": c.record, "output": c.output, "observations": c.n_obs, "rmse": c.rmse, "noise": c.noise,
        })).collect::<Vec<_>>(),
        "warnings": warnings(study),
    })
}

/// An output, or a field with the number of its components that are observed.
fn name_of(study: &Study, channels: &[TrialChannel]) -> String {
    let outputs: Vec<String> = channels.iter().map(|c| c.output.clone()).collect();
    if channels.len() < 2 {
        return outputs.concat();
    }
    let field = field_of(&outputs[0]);
    match study.spec.outputs.iter().find(|q| q.name == field) {
        Some(q) if q.size > outputs.len() => {
            format!("{field} ({} of {} components observed)", outputs.len(), q.size)
        }
        _ => observed_fields(&outputs).join(", "),
    }
}

/// One line for a channel, or for the observed components of a field: weighted by their observations.
fn pooled(study: &Study, channels: &[TrialChannel]) -> Vec<String> {
    let name = name_of(study, channels);
    let n_obs: usize = channels.iter().map(|c| c.n_obs).sum();
    let mean_square = |of: fn(&TrialChannel) -> f64| {
        let sum: f64 = channels.iter().map(|c| c.n_obs as f64 * of(c).powi(2)).sum();
        number((sum / n_obs.max(1) as f64).sqrt(), None)
    };
    let record = channels.first().map_or(String::new(), |c| c.record.clone());
    vec![record, name, n_obs.to_string(), mean_square(|c| c.rmse), mean_square(|c| c.noise)]
}

fn print(study: &Study, channels: &[TrialChannel], ensemble: (usize, bool)) -> Result<(), Failure> {
    line(format_args!("{}: model {}, {}", study.name, study.setup.model.kind, study.describe_estimator()))?;
    line("\nparameters")?;
    let mut rows = vec![["name", "unit", "prior median", "prior 95 %"].map(str::to_owned).to_vec()];
    for e in posterior::estimates(study, &posterior::prior(study)) {
        let [lo, hi] = e.prior_interval95.map(|v| number(v, None));
        rows.push(vec![e.name, e.unit, number(e.prior_median, None), format!("{lo} … {hi}")]);
    }
    text(table(&rows, false))?;
    if !channels.is_empty() {
        print_trial(study, channels)?;
    }
    let runs = runs_per_pass(study, ensemble);
    let per = match passes(study) {
        None => "iteration".to_owned(),
        Some((least, most)) if least == most => {
            format!("pass, {least} pass{}", if least == 1 { "" } else { "es" })
        }
        Some((least, most)) => {
            format!("pass, {least} to {most} passes: as many as the estimate takes to settle")
        }
    };
    if study.estimator.kind.has_exact_slopes() {
        line(format_args!("\n{runs} runs of the model with their slopes per {per}"))?;
    } else {
        line(format_args!("\n{} particles, {runs} runs of the model per {per}", ensemble.0))?;
    }
    if let Some(states) = states_text(study) {
        line(states)?;
    }
    for warning in warnings(study) {
        line(format_args!("warning: {warning}"))?;
    }
    line("the study is sound")
}

/// Everything that is doubtful in the file, also in effects that only a search tries.
fn warnings(study: &Study) -> Vec<String> {
    let of_candidates = study.candidate_warnings.iter().map(|(_, warning)| warning.clone());
    study.warnings.iter().cloned().chain(of_candidates).collect()
}

fn print_trial(study: &Study, channels: &[TrialChannel]) -> Result<(), Failure> {
    line("\ntrial run at the prior median")?;
    let mut rows = vec![["record", "output", "observations", "rmse", "noise"].map(str::to_owned).to_vec()];
    let of_field = |a: &TrialChannel, b: &TrialChannel| {
        a.record == b.record && field_of(&a.output) == field_of(&b.output)
    };
    rows.extend(channels.chunk_by(of_field).map(|channels| pooled(study, channels)));
    text(table(&rows, false))
}
