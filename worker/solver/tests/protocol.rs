//! A model behind the protocol of external solvers gives what it gives in this process.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use starlings_models::equations::EquationsDef;
use starlings_models::{
    Addition, BuildSetup, EffectDef, EffectParameter, EffectState, External, Forward, Job, ModelDef,
    ObserverDef, ParticleError, Run, SOLVER, Setup, Signal, Solve, Solved, SolverDef, Window,
};
use starlings_solver::conformance::{Trial, conformance};
use starlings_solver::serve::{Served, serve};
use starlings_solver::{SiteOptions, Solvers};

/// A driven, damped oscillator.
fn oscillator() -> ModelDef {
    let equations: EquationsDef = serde_json::from_value(serde_json::json!({
        "states": [
            { "name": "x", "unit": "m", "role": "displacement", "initial": "0.1", "rate": [["", "v"]] },
            { "name": "v", "unit": "m/s", "role": "velocity", "initial": "0", "rate": [["", "-k*x - c*v + f"]] },
        ],
        "outputs": [
            { "name": "place", "unit": "m", "value": "x" },
            { "name": "speed", "unit": "m/s", "value": "v" },
        ],
        "inputs": [{ "name": "f", "unit": "N" }],
    }))
    .unwrap();
    ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() }
}

/// Serves the oscillator on a socket of this folder, and what reaches it.
fn served(folder: &Path) -> (Solvers, SolverDef) {
    let socket = folder.join("socket");
    let (model, at) = (Served::new(oscillator()).unwrap(), socket.clone());
    std::thread::spawn(move || serve(model, &at));
    let address = Some(format!("unix:{}", socket.display()));
    (Solvers::new(SiteOptions::default()), SolverDef { address, ..SolverDef::default() })
}

/// The native setup and the same one behind the protocol.
fn both(solvers: &Solvers, def: &SolverDef, effects: Vec<EffectDef>) -> (Box<dyn Forward>, Box<dyn Forward>) {
    let names = effects.iter().flat_map(|e| e.parameters.iter().map(|p| p.name.clone()));
    let native = Setup {
        model: oscillator(),
        parameters: ["k", "c", "initial:x"].map(str::to_owned).into_iter().chain(names).collect(),
        outputs: vec!["speed".to_owned(), "place".to_owned()],
        effects,
        ..Setup::default()
    };
    let described = Some(solvers.describe(def).unwrap());
    let solver = Some(Box::new(SolverDef { described, ..def.clone() }));
    let model = ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() };
    let outside = Setup { model, ..native.clone() };
    (native.build().unwrap(), solvers.build(&outside).unwrap())
}

fn job(theta: &[f64], from: usize, to: usize, state: Option<Vec<f64>>) -> Job {
    let time = |i: usize| i as f64 * 0.05;
    let drive: Vec<f64> = (0..81).map(|i| (1.7 * time(i)).sin()).collect();
    let window = Window::free(
        time(from),
        (from + 1..=to).map(time).collect(),
        2,
        vec![Signal { times: (0..81).map(time).collect(), values: drive }],
    );
    Job {
        particle: 3,
        record: 0,
        window: Arc::new(window),
        theta: theta.to_vec(),
        state: state.map(Into::into),
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn effect(name: &str, to: &str, term: &str, states: Vec<EffectState>) -> EffectDef {
    EffectDef {
        name: name.to_owned(),
        adds: vec![Addition { to: to.to_owned(), term: term.to_owned() }],
        parameters: vec![EffectParameter { name: "a".to_owned(), ..EffectParameter::default() }],
        states,
        ..EffectDef::default()
    }
}

#[test]
fn a_model_behind_the_wire_gives_the_same_bits_also_from_a_state() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let (native, outside) = both(&solvers, &def, Vec::new());
    let theta = [30.0, 0.7, 0.2];
    let whole =
        (native.run(&job(&theta, 0, 40, None)).unwrap(), outside.run(&job(&theta, 0, 40, None)).unwrap());
    assert_eq!(bits(&whole.0.outputs), bits(&whole.1.outputs));
    assert_eq!(bits(&whole.0.state), bits(&whole.1.state));
    let half = outside.run(&job(&theta, 0, 20, None)).unwrap();
    let rest = outside.run(&job(&theta, 20, 40, Some(half.state.into_vec()))).unwrap();
    // The integrator of the whole run meets the same grid of inputs.
    assert!(apart(&rest.outputs, &whole.1.outputs[40..]) < 1e-9);
}

#[test]
fn effects_on_inputs_and_outputs_are_those_of_the_native_model() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let cases = [
        // Exact: nothing is interpolated.
        ("offset", effect("offset", "output:place", "a", Vec::new()), 1e-12),
        ("gain", effect("gain", "output:speed", "a*speed", Vec::new()), 1e-12),
        ("input gain", effect("input gain", "f", "a*f", Vec::new()), 1e-7),
        ("drift", effect("drift", "f", "a*t", Vec::new()), 1e-7),
    ];
    let theta = [30.0, 0.7, 0.2, 0.13];
    for (name, effect, tolerance) in cases {
        let (native, outside) = both(&solvers, &def, vec![effect]);
        let (a, b) =
            (native.run(&job(&theta, 0, 40, None)).unwrap(), outside.run(&job(&theta, 0, 40, None)).unwrap());
        let without = native.run(&job(&[30.0, 0.7, 0.2, 0.0], 0, 40, None)).unwrap();
        assert!(apart(&a.outputs, &without.outputs) > 1e-3, "{name} does something");
        assert!(apart(&a.outputs, &b.outputs) < tolerance, "{name}: {}", apart(&a.outputs, &b.outputs));
    }
}

#[test]
fn an_effect_with_a_memory_goes_on_from_window_to_window() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let state = EffectState {
        name: "lagging".to_owned(),
        initial: "0.2".to_owned(),
        rate: "(place - lagging)/0.15".to_owned(),
        ..EffectState::default()
    };
    let lag = effect("lag", "output:place", "a*(lagging - place)", vec![state]);
    let (native, outside) = both(&solvers, &def, vec![lag]);
    let theta = [30.0, 0.7, 0.2, 1.0];
    let whole = native.run(&job(&theta, 0, 40, None)).unwrap();
    let (mut state, mut outputs) = (None, Vec::new());
    for i in 0..40 {
        let part = outside.run(&job(&theta, i, i + 1, state)).unwrap();
        outputs.extend(part.outputs);
        state = Some(part.state.into_vec());
    }
    // Between two observations the signal that the lag sees is a line: an error of the order of the sampling squared.
    let plain = native.run(&job(&[30.0, 0.7, 0.2, 0.0], 0, 40, None)).unwrap();
    assert!(apart(&plain.outputs, &whole.outputs) > 0.05);
    assert!(apart(&outputs, &whole.outputs) < 5e-3, "{}", apart(&outputs, &whole.outputs));
}

#[test]
fn a_hosted_term_is_that_of_the_native_model_and_another_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let drag = effect("drag", "v", "-a*v*abs(v)", Vec::new());
    let (native, outside) = both(&solvers, &def, vec![drag.clone()]);
    let theta = [30.0, 0.7, 0.2, 1.5];
    let (a, b) =
        (native.run(&job(&theta, 0, 40, None)).unwrap(), outside.run(&job(&theta, 0, 40, None)).unwrap());
    assert!(apart(&a.outputs, &b.outputs) < 1e-9, "{}", apart(&a.outputs, &b.outputs));
    let mut described = solvers.describe(&def).unwrap();
    described.hosts.clear();
    let solver = Some(Box::new(SolverDef { described: Some(described), ..def }));
    let model = ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() };
    let setup = Setup { model, effects: vec![drag], ..Setup::default() };
    let error = setup.model().err().unwrap().to_string();
    assert!(
        error.contains("effect `drag` adds to the rate of `v`") && error.contains("it hosts none"),
        "{error}"
    );
}

#[test]
fn what_a_solver_cannot_do_from_outside_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let mut described = solvers.describe(&def).unwrap();
    described.observers.push("nudging".to_owned());
    let state = EffectState {
        name: "lagging".to_owned(),
        rate: "place - lagging".to_owned(),
        ..EffectState::default()
    };
    let lag = effect("lag", "output:place", "a*(lagging - place)", vec![state]);
    let solver = Some(Box::new(SolverDef { described: Some(described.clone()), ..def }));
    let setup = Setup {
        model: ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() },
        parameters: ["k", "c", "a"].map(str::to_owned).to_vec(),
        outputs: vec!["place".to_owned()],
        effects: vec![lag],
        ..Setup::default()
    };
    let refused = |setup: &Setup| External::new(setup, described.clone(), Nobody).err().unwrap().to_string();
    let mut pulled = setup.clone();
    pulled.observer = ObserverDef { kind: "nudging".to_owned(), gain: 1.0, ..ObserverDef::default() };
    assert!(
        refused(&pulled).contains("cannot go with an observer inside the solver"),
        "{}",
        refused(&pulled)
    );
    let mut begun = setup.clone();
    begun.parameters.push("initial:lagging".to_owned());
    assert!(refused(&begun).contains("initial value of an effect's own state"), "{}", refused(&begun));
    assert!(External::new(&setup, described, Nobody).is_ok());
}

/// A solver that is never asked.
struct Nobody;

impl Solve for Nobody {
    fn solve(&self, _run: &Run<'_>) -> Result<Solved, ParticleError> {
        Err(ParticleError::Infrastructure("nobody is asked here".to_owned()))
    }
}

#[test]
fn a_sound_solver_passes_every_check_that_it_gives_occasion_for() {
    let folder = tempfile::tempdir().unwrap();
    let (solvers, def) = served(folder.path());
    let times: Vec<f64> = (0..30).map(|i| 0.1 * f64::from(i)).collect();
    let given = BTreeMap::from([("k".to_owned(), 20.0), ("c".to_owned(), 0.5), ("f".to_owned(), 1.0)]);
    let found = conformance(&solvers, &def, |d| Trial::of(d, &given, &times)).unwrap();
    assert!(found.failed.is_empty(), "{:?}", found.failed);
    assert!(found.passed.len() >= 9, "{:?}", found.skipped);
}

#[test]
fn an_unknown_adapter_offers_the_nearest_and_a_solver_without_command_says_what_it_needs() {
    let solvers = Solvers::new(SiteOptions::default());
    let def = SolverDef { adapter: "grcp".to_owned(), ..SolverDef::default() };
    let error = solvers.describe(&def).unwrap_err().to_string();
    assert!(error.contains("no adapter named `grcp`; did you mean `grpc`?"), "{error}");
    let error = solvers.describe(&SolverDef::default()).unwrap_err().to_string();
    assert!(error.contains("needs a `command`"), "{error}");
}
