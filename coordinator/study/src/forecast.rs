//! What a run says of the future: an ensemble of runs with parameters drawn from its posterior, and with the model's noise.
//!
//! Every member starts where the record does and runs freely. Members are drawn from a seed and run on the fleet; which worker
//! runs which changes no number. There are two bands: that of the quantity, which the members make, and that of what would be
//! measured, which [`measurement`] adds errors to. The arithmetic of fans and crossings is `forecast` in `starlings-estimators`. Next files to read:
//! [`ask`], then [`ensemble`], then [`result`].

pub mod ask;
pub mod ensemble;
mod error;
pub mod measurement;
mod members;
mod own_errors;
mod posterior;
pub mod result;
mod tables;

use nalgebra::DVector;
use starlings_estimators::Gaussian;
use starlings_fleet::Fleet;
use starlings_models::BuildSetup;

use crate::checked::{Channel, Record};
use crate::{RunFolder, Stage, Study};

pub use ask::{Ask, Threshold};
pub use error::StudyForecastError;
pub use result::Forecast;

use ensemble::{Ensemble, MeasuredOutput, MeasuredValue, drawn};
use measurement::TrainingResiduals;
use posterior::Drawn;

/// Forecasts from a finished run. `watch` hears of its stages.
///
/// # Errors
/// When the run is not finished, what is asked does not fit the study, the fleet fails, or no member has a prediction.
pub fn forecast(
    study: &Study,
    folder: &RunFolder,
    fleet: &mut dyn Fleet,
    ask: &Ask,
    watch: &mut dyn FnMut(&Stage),
) -> Result<Forecast, StudyForecastError> {
    let drawn = Drawn::read(study, folder)?;
    let residuals = TrainingResiduals::read(study, folder)?;
    let plan = ask.plan(study)?;
    let record = &study.records[plan.record];
    let measured = plan.setup.outputs.iter().map(|name| {
        let channel = record.channels.iter().find(|c| c.output == *name && c.node.is_none())?;
        let values = measured_values(record, channel, &plan.times);
        let errors = residuals.errors(name, channel.noise);
        Some(MeasuredOutput { errors, values, never_fitted: residuals.are_none_of(name) })
    });
    let measured: Vec<_> = measured.collect();
    let ensemble = Ensemble {
        record: (plan.record as u32, record.name.clone()),
        inputs: record.inputs.clone(),
        members: members(study, &plan, &drawn.gaussian),
        measured_until: record.times.last().copied().unwrap_or_default(),
        wider: drawn.wider,
        conditional_on: conditional_on(drawn.wider, measured.iter().flatten().any(|m| m.never_fitted)),
        measured,
        warnings: warnings(study, ask),
        setup: plan.setup,
        times: plan.times,
    };
    ensemble.forecast(study, fleet, ask, watch)
}

/// The parameters of every member, drawn from the posterior.
fn members(study: &Study, plan: &ask::Plan, posterior: &Gaussian) -> Vec<Vec<f64>> {
    let member = |drawn: DVector<f64>| {
        let mut theta = study.theta_for(plan.record, drawn.as_slice());
        for (place, value) in &plan.fixed {
            theta[*place] = *value;
        }
        theta
    };
    drawn(posterior, plan.members, plan.seed).into_iter().map(member).collect()
}

/// What a channel measured at times of the forecast.
fn measured_values(record: &Record, channel: &Channel, times: &[f64]) -> Vec<MeasuredValue> {
    let value = |time: &f64| {
        let value = record.observed(channel, *time)?;
        let held_out = channel.held_out || !record.trains_at(*time);
        Some(MeasuredValue { time: *time, value, held_out })
    };
    record
        .times
        .iter()
        .take_while(|time| times.last().is_some_and(|last| *time <= last))
        .filter_map(value)
        .collect()
}

fn conditional_on(wider: Option<f64>, never_fitted: bool) -> String {
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
         residuals, and at least the stated noise{}; what the model lacks only later is in neither band.",
        if never_fitted {
            ", and for an output that was never fitted as large as its own values show outside the fifth of the record where they stand"
        } else {
            ""
        }
    )
}

fn warnings(study: &Study, ask: &Ask) -> Vec<String> {
    let mut warnings = Vec::new();
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
