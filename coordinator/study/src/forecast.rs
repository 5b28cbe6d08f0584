//! What a run says of the future: an ensemble of runs with parameters drawn from its posterior, and with the model's noise.
//!
//! Every member starts where the record does and runs freely. Members are drawn from a seed and run on the fleet; which worker
//! runs which changes no number. There are two bands: that of the quantity, which the members make, and that of what would be
//! measured, which [`measurement`] adds errors to. The arithmetic of fans and crossings is `forecast` in `starlings-estimators`. Next files to read:
//! [`ask`], then [`members`], then [`result`].

pub mod ask;
mod error;
pub mod measurement;
mod members;
mod posterior;
pub mod result;
mod tables;

use starlings_estimators::forecast::{Crossings, Fan};
use starlings_fleet::Fleet;
use starlings_models::BuildSetup;

use crate::{RunFolder, Study};

pub use ask::{Ask, Threshold};
pub use error::StudyForecastError;
pub use result::Forecast;

use measurement::TrainingResiduals;
use members::Members;
use posterior::Drawn;
use result::{LevelForecast, OutputForecast};

/// Forecasts from a finished run.
///
/// # Errors
/// When the run is not finished, what is asked does not fit the study, the fleet fails, or no member has a prediction.
pub fn forecast(
    study: &Study,
    folder: &RunFolder,
    fleet: &mut dyn Fleet,
    ask: &Ask,
) -> Result<Forecast, StudyForecastError> {
    let drawn = Drawn::read(study, folder)?;
    let residuals = TrainingResiduals::read(study, folder)?;
    let plan = ask.plan(study)?;
    let members = Members::run(study, fleet, &plan, &drawn.gaussian)?;
    let mut outputs = Vec::with_capacity(plan.setup.outputs.len());
    for row in 0..plan.setup.outputs.len() {
        outputs.push(output(study, &plan, &members, &residuals, row)?);
    }
    let levels = ask.thresholds.iter().map(|threshold| {
        let row = plan.row(&threshold.output);
        let crossings = Crossings::of(&plan.times, &members.courses(row), threshold.level)?;
        Ok(LevelForecast::new(study, threshold, ask.horizon, crossings))
    });
    let levels = levels.collect::<Result<Vec<_>, StudyForecastError>>()?;
    Ok(Forecast {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        record: study.records[ask.record].name.clone(),
        time_unit: study.time_unit.clone(),
        from: plan.times[0],
        measured_until: study.records[ask.record].times.last().copied().unwrap_or_default(),
        until: plan.times[plan.times.len() - 1],
        members: ask.members,
        failed: members.n_failed(),
        seed: ask.seed,
        model_noise: plan.setup.noise.is_some(),
        wider_given_residuals: drawn.wider,
        conditional_on: conditional_on(drawn.wider),
        set: ask.values.clone(),
        warnings: warnings(study, ask, &members),
        outputs,
        levels,
    })
}

fn output(
    study: &Study,
    plan: &ask::Plan,
    members: &Members,
    residuals: &TrainingResiduals,
    row: usize,
) -> Result<OutputForecast, StudyForecastError> {
    let courses = members.courses(row);
    let fan = Fan::of(&plan.times, &courses, &Fan::USUAL)?;
    let name = &plan.setup.outputs[row];
    let record = &study.records[plan.record];
    let channel = record.channels.iter().find(|c| c.output == *name && c.node.is_none());
    let errors = channel.map(|c| residuals.errors(name, c.noise));
    let measured = errors
        .map(|errors| Fan::of(&plan.times, &members.with_noise(row, errors.sd, plan.seed), &Fan::USUAL))
        .transpose()?;
    Ok(OutputForecast::new(study, name, fan, measured.zip(errors), channel.map(|c| (record, c))))
}

fn conditional_on(wider: Option<f64>) -> String {
    let spread = wider.map_or_else(
        || {
            "on the posterior at the stated noise, since the run has none given its residuals: bands are too narrow where the \
             noise is not white or larger than stated"
                .to_owned()
        },
        |wider| {
            format!(
                "on the posterior given the residuals of the run, in which a parameter's sd is up to {wider:.2} times that at the \
                 stated noise"
            )
        },
    );
    format!(
        "Bands are conditional on the model and {spread}. The band of what would be measured holds errors as large as the training \
         residuals, and at least the stated noise; what the model lacks only later is in neither band."
    )
}

fn warnings(study: &Study, ask: &Ask, members: &Members) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(reason) = &members.failure {
        warnings.push(format!(
            "{} of {} members have no prediction and are left out of every figure: {reason}",
            members.n_failed(),
            ask.members
        ));
    }
    let end = study.records[ask.record].times.last().copied().unwrap_or_default();
    let late = ask.until.is_some_and(|until| until > end);
    if late && !study.spec.inputs.is_empty() {
        warnings.push(format!("inputs stay at their last value after the record's end at {end}"));
    }
    if study.setup.is_noisy() {
        warnings.push(
            "members start at the record's start with noise of their own: what the recording shows of the noise so far is not used"
                .to_owned(),
        );
    }
    warnings
}
