//! Which equations can take an unknown input, and how much a constant one changes the outputs.
//!
//! Next file to read: [`super::walk`].

use std::sync::Arc;

use starlings_fleet::{Fleet, Outcome, SetupId};
use starlings_models::effect::{Addition, EffectParameter};
use starlings_models::{EffectDef, Job, Prediction, Quantity, SOLVER, Setup, Spec, Window};
use starlings_study::Study;

use crate::error::{ExplainError, fleet_failure};

/// Change of the outputs, in noise sd, below which an input counts as without influence.
const FELT: f64 = 1e-6;

/// A state whose rate takes an unknown input.
pub(super) struct Candidate {
    /// Name of the state.
    pub(super) state: String,
    /// Its unit label.
    pub(super) unit: String,
    /// The model with the input, as the fleet knows it; the input is the last parameter.
    pub(super) setup: SetupId,
    /// The constant input that moves the outputs about as far as the residuals are.
    pub(super) scale: f64,
    /// What the channels would have measured of the record without an input.
    pub(super) without: Vec<f64>,
    /// Change of the outputs in noise sd by an input that would move the state by its own size over the record.
    felt: f64,
}

/// An equation and the runs of the record with it.
struct Trial<'a> {
    quantity: &'a Quantity,
    setup: SetupId,
    without: Prediction,
    /// A constant input so small that the response of a nonlinear model is linear in it.
    input: f64,
}

/// The scalar states whose input changes the channels, the largest change first: two runs of the record each, in two batches.
/// None of a solver, whose equations are not open to an input in every rate.
pub(super) fn candidates(
    study: &Study,
    fleet: &mut dyn Fleet,
    theta: &[f64],
    record: usize,
    runs: &mut u64,
) -> Result<Vec<Candidate>, ExplainError> {
    if study.setup.model.kind == SOLVER {
        return Ok(Vec::new());
    }
    let window = Arc::new(study.whole(record, true));
    let values = study.theta_for(record, theta);
    let mut fly = |fleet: &mut dyn Fleet,
                   inputs: Vec<(SetupId, f64)>|
     -> Result<Vec<Option<Prediction>>, ExplainError> {
        *runs += inputs.len() as u64;
        let job = |(particle, (setup, input)): (usize, (SetupId, f64))| {
            let theta = values.iter().copied().chain([input]).collect();
            let (particle, record, window) = (particle as u32, record as u32, Arc::clone(&window));
            (setup, Job { particle, record, window, theta, state: None })
        };
        let jobs = inputs.into_iter().enumerate().map(job).collect();
        let outcomes = fleet.run_mixed(jobs).map_err(|error| fleet_failure(study, error))?;
        Ok(predictions(study, record, &window, outcomes))
    };
    let equations = equations(study, fleet)?;
    let at_rest = fly(fleet, equations.iter().map(|(_, _, setup)| (*setup, 0.0)).collect())?;
    let span = window.times.last().copied().unwrap_or(window.start) - window.start;
    let trial = |((quantity, at, setup), without): ((_, usize, SetupId), Option<Prediction>)| {
        let without = without?;
        let size = without.state.get(at).map_or(0.0, |x| x.abs()).max(1e-3);
        Some(Trial { quantity, setup, without, input: 1e-3 * size / span.max(f64::MIN_POSITIVE) })
    };
    let trials: Vec<Trial<'_>> = equations.into_iter().zip(at_rest).filter_map(trial).collect();
    let moved = fly(fleet, trials.iter().map(|t| (t.setup, t.input)).collect())?;
    let candidate = |(trial, with): (Trial<'_>, Option<Prediction>)| {
        let Trial { quantity, setup, without, input } = trial;
        let (moved, missed) = sizes(study, record, &window, &without, &with?);
        let (state, unit) = (quantity.name.clone(), quantity.unit.clone());
        let (scale, without) = (input * missed.max(1.0) / moved, without.outputs);
        (moved / 1e-3 > FELT).then_some(Candidate { state, unit, setup, scale, without, felt: moved })
    };
    let mut found: Vec<Candidate> = trials.into_iter().zip(moved).filter_map(candidate).collect();
    found.sort_by(|a, b| b.felt.total_cmp(&a.felt));
    Ok(found)
}

/// The scalar states of the model itself with their place and the setup with an input.
fn equations<'s>(
    study: &'s Study,
    fleet: &mut dyn Fleet,
) -> Result<Vec<(&'s Quantity, usize, SetupId)>, ExplainError> {
    let own = own_states(study);
    let mut equations = Vec::new();
    for quantity in study.spec.states.iter().filter(|q| q.size == 1 && !own.contains(&q.name)) {
        let Some(at) = Spec::offset(&study.spec.states, &quantity.name) else { continue };
        equations.push((quantity, at, fleet.install(&with_input(study, &quantity.name))?));
    }
    Ok(equations)
}

/// What the channels would measure by each outcome, particle by particle; nothing where the model fails.
pub(super) fn predictions(
    study: &Study,
    record: usize,
    window: &Window,
    outcomes: Vec<Outcome>,
) -> Vec<Option<Prediction>> {
    let of = |outcome: Outcome| {
        let mut prediction = outcome.result.ok().filter(|p| p.outputs.len() == window.observed.len())?;
        study.measure(record, &window.times, &mut prediction.outputs);
        Some(prediction)
    };
    outcomes.into_iter().map(of).collect()
}

/// States that effects of the study brought.
fn own_states(study: &Study) -> Vec<String> {
    let effects =
        study.setup.written_out_effects(&study.spec).unwrap_or_else(|_| study.setup.effects.clone());
    effects.into_iter().flat_map(|e| e.states).map(|s| s.name).collect()
}

/// The study's setup with one more parameter that is added to the state's rate.
fn with_input(study: &Study, state: &str) -> Setup {
    let mut setup = study.setup.clone();
    let name = format!("unknown_input_of_{}", state.replace(|c: char| !c.is_ascii_alphanumeric(), "_"));
    setup.effects.push(EffectDef {
        name: name.clone(),
        adds: vec![Addition { to: state.to_owned(), term: name.clone() }],
        parameters: vec![EffectParameter { name: name.clone(), ..EffectParameter::default() }],
        ..EffectDef::default()
    });
    setup.parameters.push(name);
    setup
}

/// Root mean squares in noise sd: of the change by the trial input, and of the residuals without it.
fn sizes(
    study: &Study,
    record: usize,
    window: &Window,
    without: &Prediction,
    with: &Prediction,
) -> (f64, f64) {
    let noise = study.noise(record);
    let (mut n, mut moved, mut missed) = (0.0_f64, 0.0, 0.0);
    for (k, observed) in window.observed.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        let sd = noise[k % noise.len()];
        n += 1.0;
        moved += ((with.outputs[k] - without.outputs[k]) / sd).powi(2);
        missed += ((observed - without.outputs[k]) / sd).powi(2);
    }
    ((moved / n.max(1.0)).sqrt(), (missed / n.max(1.0)).sqrt())
}
