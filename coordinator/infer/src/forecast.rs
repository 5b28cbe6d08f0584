//! What an inference says of the future: an ensemble with coefficients and noise drawn from its posterior, from the last row on.
//!
//! The order of the files is that of the work: [`known`] (the posterior of a finished inference, or of one that is followed), `last_row.rs`
//! (where members start, and what came after), `model.rs` (the equations with those coefficients and that noise). What members are run with
//! and what is told of them is the ensemble of [`starlings_study::forecast`].

pub mod known;
mod last_row;
mod model;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_fleet::Fleet;
use starlings_models::Signal;
use starlings_study::forecast::ensemble::{Ensemble, MeasuredOutput, MeasuredValue, draws};
use starlings_study::forecast::measurement::{Errors, From};
use starlings_study::forecast::{Ask, Forecast};
use starlings_study::infer_choice::InferRecord;
use starlings_study::{Stage, Study};

use crate::error::InferError;
use crate::run::{asked, choice};
use known::Known;
use last_row::{After, LastRow};
use model::Simulated;

/// Rounding of a time that a study states, as part of a step.
const SAME: f64 = 1e-6;

/// Forecasts from what is known of a study that was read for an inference. `record` of the request is one of those that were inferred
/// from. `watch` hears of its stages.
///
/// # Errors
/// When what is known is of another study, what is asked does not fit it, a recording cannot be read, the fleet fails or no member has
/// a prediction.
pub fn forecast(
    study: &Study,
    known: &Known,
    fleet: &mut dyn Fleet,
    ask: &Ask,
    watch: &mut dyn FnMut(&Stage),
) -> Result<Forecast, InferError> {
    Ok(ensemble(study, known, ask)?.forecast(study, fleet, ask, watch)?)
}

/// Refuses what makes no forecast, before anything runs.
///
/// # Errors
/// As [`forecast`], but for those of its runs.
pub fn check(study: &Study, known: &Known, ask: &Ask) -> Result<(), InferError> {
    ensemble(study, known, ask).map(drop)
}

/// The members with what they are compared with.
fn ensemble(study: &Study, known: &Known, ask: &Ask) -> Result<Ensemble, InferError> {
    let choice = choice(study)?;
    let Some(record) = choice.records.get(ask.record) else {
        return Err(InferError::Setting("the study has no record to forecast from".to_owned()));
    };
    let question = asked(study, choice, known.step)?.question;
    let mut simulated = Simulated::new(study, choice, &question, known)?;
    let (last, after) = match &known.last {
        Some((time, values)) => (LastRow { time: *time, values: values.clone() }, After::default()),
        None => last_row::read(record, ask.until.map(|until| SAME.mul_add(known.step, until)))?,
    };
    let recorded: Vec<f64> = std::iter::once(last.time).chain(after.times.iter().copied()).collect();
    if after.times.is_empty() && ask.until.is_none() {
        let message = format!(
            "the recording ends at {}, where the forecast begins: say how far it goes with --until T",
            last.time
        );
        return Err(InferError::Setting(message));
    }
    let n_state = question.basis.n_state();
    let shown = model::shown(study);
    simulated.setup.outputs = ask.outputs(study, shown.iter().map(|(output, _)| output))?;
    let fixed = ask.set(study, &mut simulated.setup)?;
    simulated.setup.noise = Some(ask.seed);
    let times = ask.times(&recorded, known.step)?;
    ask.room(simulated.setup.outputs.len(), times.len())?;
    let mut rng = draws(ask.seed);
    let member = |_| {
        let drawn = known.draws.draw(&mut rng);
        let start: Vec<f64> = last.values[..n_state]
            .iter()
            .zip(&known.measured)
            .map(|(value, sd)| value + sd * normal(&mut rng))
            .collect();
        let mut theta = simulated.theta(drawn.coefficients.as_slice(), &drawn.noise, &start);
        for (place, value) in &fixed {
            theta[*place] = *value;
        }
        theta
    };
    let members = (0..ask.members).map(member).collect();
    let measured = simulated
        .setup
        .outputs
        .iter()
        .map(|output| measured(output, &shown, known, &after, &times))
        .collect();
    let warnings = warnings(known, n_state, &last, &after, times[times.len() - 1]);
    Ok(Ensemble {
        record: (ask.record as u32, record.name.clone()),
        inputs: inputs(record, n_state, &last, &after),
        measured,
        measured_until: recorded[recorded.len() - 1],
        wider: None,
        conditional_on: conditional_on(known),
        warnings,
        members,
        setup: simulated.setup,
        times,
    })
}

/// What is measured of an output that shows a state, up to the end of the forecast.
fn measured(
    output: &str,
    shown: &[(String, usize)],
    known: &Known,
    after: &After,
    times: &[f64],
) -> Option<MeasuredOutput> {
    let (_, state) = shown.iter().find(|(name, _)| name == output)?;
    let sd = known.measured[*state];
    let rows = after.times.iter().zip(&after.rows).filter(|(time, _)| times.last() >= Some(*time));
    let value =
        |(time, row): (&f64, &Vec<f64>)| MeasuredValue { time: *time, value: row[*state], held_out: true };
    Some(MeasuredOutput {
        errors: Errors { noise: sd, sd, from: From::Inferred },
        values: rows.map(value).collect(),
        never_fitted: false,
    })
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// The inputs from the last row on, which stay as they are after the recording.
fn inputs(record: &InferRecord, n_state: usize, last: &LastRow, after: &After) -> Vec<Signal> {
    let signal = |column: usize| Signal {
        times: std::iter::once(last.time).chain(after.times.iter().copied()).collect(),
        values: std::iter::once(last.values[column])
            .chain(after.rows.iter().map(|row| row[column]))
            .collect(),
    };
    (n_state..record.columns.len()).map(signal).collect()
}

fn conditional_on(known: &Known) -> String {
    let start = if known.measured.iter().any(|sd| *sd > 0.0) {
        "at the last row with errors of the measurement as the inference has them"
    } else {
        "at the last row as it was measured"
    };
    format!(
        "Bands are conditional on the model and on the posterior of the inference: coefficients are drawn from their Student distribution \
         and the noise of the states from its inverse Wishart distribution. Members start {start}, and every one has noise of its own. \
         What the model lacks is in neither band."
    )
}

fn warnings(known: &Known, n_state: usize, last: &LastRow, after: &After, until: f64) -> Vec<String> {
    let mut warnings = known.warnings.clone();
    let end = after.times.last().copied().unwrap_or(last.time);
    if last.values.len() > n_state && until > end {
        warnings.push(format!("inputs stay at their last value after the record's end at {end}"));
    }
    warnings
}
