//! Setups and windows shared by the tests of this crate.
#![allow(clippy::unwrap_used, dead_code, reason = "test helpers; each test binary uses its part")]

use std::sync::Arc;

use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{
    BuildSetup, Forward, Job, ModelDef, Prediction, Setup, Signal, Spec, Window, catalogue,
};

/// A setup of one kind that predicts every output, with its parameters estimated; and plausible values for them.
pub(crate) fn setup(kind: &str) -> (Setup, Vec<f64>) {
    let model = ModelDef {
        kind: kind.to_owned(),
        equations: (kind == catalogue::EQUATIONS).then(pendulum),
        ..ModelDef::default()
    };
    let mut setup = Setup { model, ..Setup::default() };
    let spec = setup.spec().unwrap();
    setup.parameters = spec.parameters.iter().map(|q| q.name.clone()).collect();
    setup.outputs = spec.outputs.iter().map(|q| q.name.clone()).collect();
    (setup, plausible(&spec))
}

/// The defaults of a model's parameters, and plausible values for those without one.
pub(crate) fn plausible(spec: &Spec) -> Vec<f64> {
    spec.parameters.iter().enumerate().map(|(i, q)| q.default.unwrap_or(0.7 + 0.3 * i as f64)).collect()
}

/// Every kind of the catalogue.
pub(crate) fn kinds() -> Vec<String> {
    catalogue::specs().into_iter().map(|spec| spec.kind).collect()
}

/// A driven pendulum with dry friction: nonlinear, switching, with an input.
fn pendulum() -> EquationsDef {
    let state = |name: &str, initial: &str, rate: &str| StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    };
    EquationsDef {
        states: vec![
            state("angle", "0.3", "speed"),
            state("speed", "0", "-g*sin(angle) - c*speed - friction*sign(speed) + torque"),
        ],
        outputs: vec![OutputDef {
            name: "angle".to_owned(),
            value: "angle".to_owned(),
            ..OutputDef::default()
        }],
        inputs: vec![InputDef { name: "torque".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    }
}

/// A window over `[0, 1]` with `n` equal observation steps, every value missing, and a rough signal for every input.
pub(crate) fn window(setup: &Setup, n: usize) -> Window {
    let spec = setup.spec().unwrap();
    let n_input = spec.inputs.len();
    let n_obs: usize =
        setup.outputs.iter().map(|name| Spec::range_of(&spec.outputs, name).unwrap().len()).sum();
    let times: Vec<f64> = (1..=n).map(|i| i as f64 / n as f64).collect();
    // Samples that do not fall on observation times, so that steps are split.
    let sampled: Vec<f64> = (0..=37).map(|i| f64::from(i) / 36.0 - 0.004).collect();
    let signal = |k: usize| {
        let values = sampled.iter().map(|t| 40.0 * (9.0 * t + k as f64).sin().max(0.0)).collect();
        Signal { times: sampled.clone(), values }
    };
    Window::free(0.0, times, n_obs, (0..n_input).map(signal).collect())
}

/// A job from the initial state.
pub(crate) fn job(window: &Window, theta: &[f64]) -> Job {
    Job { particle: 0, record: 0, window: Arc::new(window.clone()), theta: theta.to_vec(), state: None }
}

/// Runs the whole window from the initial state.
pub(crate) fn run(model: &dyn Forward, window: &Window, theta: &[f64]) -> Prediction {
    model.run(&job(window, theta)).unwrap()
}

/// Runs the window in pieces of `every` observation times, each from the state that the one before left.
pub(crate) fn run_in_pieces(model: &dyn Forward, window: &Window, theta: &[f64], every: usize) -> Prediction {
    let n_obs = window.observed.len() / window.times.len();
    let mut whole: Prediction = Prediction::default();
    let (mut start, mut state) = (window.start, None);
    // What an observer must know of the pieces before.
    let mut since = vec![window.start; n_obs];
    for (times, observed) in window.times.chunks(every).zip(window.observed.chunks(every * n_obs)) {
        let (times_of, values) = (times.to_vec(), observed.to_vec());
        let inputs = window.inputs.clone();
        let piece = Window { start, times: times_of, observed: values, inputs, since: since.clone() };
        let prediction = model.run(&Job { state, ..job(&piece, theta) }).unwrap();
        whole.outputs.extend(prediction.outputs);
        whole.state.clone_from(&prediction.state);
        state = Some(prediction.state);
        start = times[times.len() - 1];
        for (t, values) in times.iter().zip(observed.chunks(n_obs)) {
            since.iter_mut().zip(values).filter(|(_, v)| !v.is_nan()).for_each(|(last, _)| *last = *t);
        }
    }
    whole
}

/// Largest difference between two equally long lists.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
