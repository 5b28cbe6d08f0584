//! Which equations can take an unknown input, and how strongly the data feel a constant one.
//!
//! Next file to read: [`super::walk`].

use std::sync::Arc;

use starlings_models::effect::{Addition, EffectParameter};
use starlings_models::{EffectDef, Job, Prediction, Setup, Spec, Window};

use crate::explain::ExplainError;
use crate::fleet::{Fleet, SetupId};
use crate::study::Study;

/// Change of the outputs, in noise sd, below which an input is not felt.
const FELT: f64 = 1e-6;

/// A state whose rate takes an unknown input.
pub(super) struct Candidate {
    /// Name of the state.
    pub(super) state: String,
    /// Its unit label.
    pub(super) unit: String,
    /// Its place in the state vector.
    pub(super) at: usize,
    /// The model with the input, as the fleet knows it; the input is the last parameter.
    pub(super) setup: SetupId,
    /// The constant input that moves the outputs about as far as the residuals are.
    pub(super) scale: f64,
    /// Change of the outputs in noise sd by an input that would move the state by its own size over the record.
    felt: f64,
}

/// The scalar states whose input the channels feel, the most strongly felt first: two runs of the record each.
pub(super) fn candidates(
    study: &Study,
    fleet: &mut dyn Fleet,
    theta: &[f64],
    record: usize,
    runs: &mut u64,
) -> Result<Vec<Candidate>, ExplainError> {
    let own = own_states(study);
    let window = Arc::new(study.whole(record, true));
    let values = study.theta_for(record, theta);
    let mut found = Vec::new();
    for quantity in study.spec.states.iter().filter(|q| q.size == 1 && !own.contains(&q.name)) {
        let Some(at) = Spec::offset(&study.spec.states, &quantity.name) else { continue };
        let setup = fleet.install(&with_input(study, &quantity.name))?;
        let job = |input: f64| {
            let theta = values.iter().copied().chain([input]).collect();
            Job { particle: 0, record: record as u32, window: Arc::clone(&window), theta, state: None }
        };
        let mut run = |input: f64| -> Result<Option<Prediction>, ExplainError> {
            *runs += 1;
            let outcome = fleet.run(setup, vec![job(input)])?.pop();
            Ok(outcome.and_then(|o| o.result.ok()).map(|mut p| {
                study.measure(record, &window.times, &mut p.outputs);
                p
            }))
        };
        let Some(without) = run(0.0)? else { continue };
        let span = window.times.last().copied().unwrap_or(window.start) - window.start;
        let size = without.state.get(at).map_or(0.0, |x| x.abs()).max(1e-3);
        // Small, so that the answer is the slope of a model that may be far from linear.
        let trial = 1e-3 * size / span.max(f64::MIN_POSITIVE);
        let Some(with) = run(trial)? else { continue };
        let (moved, missed) = sizes(study, record, &window, &without, &with);
        if moved / 1e-3 > FELT {
            let (state, unit) = (quantity.name.clone(), quantity.unit.clone());
            let scale = trial * missed.max(1.0) / moved;
            found.push(Candidate { state, unit, at, setup, scale, felt: moved });
        }
    }
    found.sort_by(|a, b| b.felt.total_cmp(&a.felt));
    Ok(found)
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
