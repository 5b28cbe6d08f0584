//! Models with noise: what a seed determines, in which sense the noise is meant, and what is refused.

#![allow(clippy::float_cmp, clippy::unwrap_used)] // the same bits are meant; a failed unwrap is a failed test

use std::sync::Arc;

use starlings_models_core::equations::{
    EquationsDef, EquationsModel, Method, OutputDef, SolverDef, StateDef,
};
use starlings_models_core::{Forward, Job, ModelDef, NativeModels, Setup, SetupError, Simulator, Window};

fn state(name: &str, initial: &str, rate: &str, noise: &[(&str, &str)]) -> StateDef {
    let pair = |(a, b): &(&str, &str)| ((*a).to_owned(), (*b).to_owned());
    StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![pair(&(name, rate))],
        noise: noise.iter().map(pair).collect(),
        ..StateDef::default()
    }
}

fn equations(states: Vec<StateDef>, method: Method, step: f64) -> EquationsDef {
    let output =
        |s: &StateDef| OutputDef { name: s.name.clone(), value: s.name.clone(), ..OutputDef::default() };
    EquationsDef {
        outputs: states.iter().map(output).collect(),
        states,
        solver: SolverDef { method, step: Some(step), ..SolverDef::default() },
        ..EquationsDef::default()
    }
}

fn simulator(def: &EquationsDef, noise: Option<u64>) -> Simulator {
    let model = EquationsModel::new(def).unwrap();
    let outputs = def.outputs.iter().map(|o| o.name.clone()).collect();
    let model_def =
        ModelDef { kind: "equations".to_owned(), equations: Some(def.clone()), ..ModelDef::default() };
    let setup = Setup { model: model_def, outputs, noise, ..Setup::default() };
    Simulator::new(Box::new(model), &setup, NativeModels::of(&[])).unwrap()
}

/// Predicted outputs at the times, time by time.
fn path(simulator: &Simulator, times: &[f64], particle: u32, record: u32) -> Vec<f64> {
    let n = simulator.spec().n_output();
    let window = Window::free(0.0, times.to_vec(), n, vec![]);
    let job = Job { particle, record, window: Arc::new(window), theta: vec![], state: None };
    simulator.run(&job).unwrap().outputs
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for value in values {
        sum += value;
        n += 1.0;
    }
    sum / n
}

#[test]
fn a_seed_and_a_job_determine_the_path_and_without_a_seed_there_is_no_noise() {
    let def = equations(vec![state("x", "1", "-x", &[("x", "0.5")])], Method::Heun, 0.01);
    let times: Vec<f64> = (1..=20).map(|i| 0.1 * f64::from(i)).collect();
    let noisy = simulator(&def, Some(7));
    let one = path(&noisy, &times, 0, 0);
    assert_eq!(one, path(&simulator(&def, Some(7)), &times, 0, 0));
    for other in [
        path(&noisy, &times, 1, 0),
        path(&noisy, &times, 0, 1),
        path(&simulator(&def, Some(8)), &times, 0, 0),
    ] {
        assert!(one.iter().zip(&other).all(|(a, b)| a != b));
    }
    for (x, t) in path(&simulator(&def, None), &times, 0, 0).iter().zip(&times) {
        assert!((x - (-t).exp()).abs() < 1e-5, "{x} at {t}");
    }
}

#[test]
fn an_ornstein_uhlenbeck_process_has_its_variance_and_its_memory() {
    // dx = −k x dt + s dW: variance s² / 2k, correlation exp(−k τ).
    let def = equations(vec![state("x", "0", "-2*x", &[("x", "0.6")])], Method::Heun, 0.01);
    let times: Vec<f64> = (0..40_000).map(|i| 10.0 + 0.1 * f64::from(i)).collect();
    let x = path(&simulator(&def, Some(3)), &times, 0, 0);
    let variance = mean(x.iter().map(|x| x * x));
    // 4000 time units hold about 8000 independent values: sd of the variance 1.6 %.
    assert!((variance / 0.09 - 1.0).abs() < 0.06, "{variance}");
    let correlation = mean(x.windows(2).map(|w| w[0] * w[1])) / variance;
    assert!((correlation - (-0.2_f64).exp()).abs() < 0.02, "{correlation}");
}

#[test]
fn states_that_share_a_source_are_moved_by_the_same_noise() {
    let shared = [("w", "0.4")];
    let both = [("w", "-0.4"), ("own", "0.3")];
    let states = vec![
        state("x", "0", "0", &shared),
        state("y", "0", "0", &both),
        state("z", "0", "0", &[("z", "0.3")]),
    ];
    let def = equations(states, Method::EulerMaruyama, 0.05);
    let times: Vec<f64> = (1..=20_000).map(|i| 0.1 * f64::from(i)).collect();
    let path = path(&simulator(&def, Some(5)), &times, 0, 0);
    let steps: Vec<[f64; 3]> =
        path.windows(6).step_by(3).map(|w| [w[3] - w[0], w[4] - w[1], w[5] - w[2]]).collect();
    let covariance = |i: usize, j: usize| mean(steps.iter().map(|s| s[i] * s[j])) / 0.1;
    for (i, j, wanted) in [(0, 0, 0.16), (0, 1, -0.16), (1, 1, 0.25), (0, 2, 0.0), (1, 2, 0.0), (2, 2, 0.09)]
    {
        assert!((covariance(i, j) - wanted).abs() < 0.01, "{i} {j}: {}", covariance(i, j));
    }
}

#[test]
fn heun_means_noise_as_stratonovich_and_euler_maruyama_as_ito() {
    // dx = x dW over one time unit with s = 0.5: the mean is exp(s²/2) and 1.
    for (method, wanted) in [(Method::Heun, 0.125_f64.exp()), (Method::EulerMaruyama, 1.0)] {
        let def = equations(vec![state("x", "1", "0", &[("x", "0.5*x")])], method, 0.01);
        let simulator = simulator(&def, Some(11));
        let found = mean((0..20_000).map(|particle| path(&simulator, &[1.0], particle, 0)[0]));
        // One value has the standard deviation 0.6.
        assert!((found - wanted).abs() < 0.02, "{method:?}: {found} for {wanted}");
    }
}

#[test]
fn an_increment_does_not_depend_on_where_outputs_are_wanted_but_the_path_does() {
    let def = equations(vec![state("x", "0", "-x", &[("x", "1")])], Method::Heun, 0.25);
    let simulator = simulator(&def, Some(2));
    // Outputs at ends of steps change no step.
    let few = path(&simulator, &[1.0, 2.0], 0, 0);
    let many = path(&simulator, &[0.5, 1.0, 1.5, 2.0], 0, 0);
    assert_eq!([few[0], few[1]], [many[1], many[3]]);
}

#[test]
fn noise_without_a_method_for_it_or_with_a_wrong_amplitude_is_refused_by_name() {
    let with = |noise: &[(&str, &str)], method| {
        EquationsModel::new(&equations(vec![state("x", "0", "-x", noise)], method, 0.1))
            .unwrap_err()
            .to_string()
    };
    let message = with(&[("x", "0.1")], Method::Auto);
    assert!(
        message.contains("the noise of state `x` needs a solver for it: `method = \"heun\"`"),
        "{message}"
    );
    let message = with(&[("x", "0.1"), ("x", "0.2")], Method::Heun);
    assert!(message.contains("x in the noise of x"), "{message}");
    let error =
        EquationsModel::new(&equations(vec![state("x", "0", "-x", &[("w", "0.1 +")])], Method::Heun, 0.1));
    let Err(SetupError::Expression { place, .. }) = error else {
        panic!("an amplitude that is no expression")
    };
    assert_eq!(place, "noise `w` of `x`");
    let mut def = equations(vec![state("x", "0", "-x", &[("x", "0.1")])], Method::Heun, 0.1);
    def.solver.step = None;
    let message = EquationsModel::new(&def).unwrap_err().to_string();
    assert!(message.contains("`heun` needs a positive `step`"), "{message}");
}
