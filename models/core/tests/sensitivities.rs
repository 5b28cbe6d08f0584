//! Derivatives of predictions by the values of a job, beside closed forms and central differences.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::sync::Arc;

use starlings_models_core::equations::{
    EquationsDef, EquationsModel, Method, OutputDef, SolverDef, StateDef,
};
use starlings_models_core::{
    Forward, Job, ModelDef, NativeModels, ObserverDef, Setup, SetupError, Simulator, Window,
};

/// States by name, start and rate; outputs by name and value.
struct Written<'a> {
    states: &'a [[&'a str; 3]],
    outputs: &'a [[&'a str; 2]],
    constants: &'a [(&'a str, f64)],
    /// Fixed steps of this length; none for the default.
    step: Option<f64>,
}

impl Written<'_> {
    fn simulator(&self, setup: &Setup) -> Result<Simulator, SetupError> {
        let states = self.states.iter().map(|[name, initial, rate]| StateDef {
            name: (*name).to_owned(),
            initial: (*initial).to_owned(),
            rate: vec![(format!("rate {name}"), (*rate).to_owned())],
            ..StateDef::default()
        });
        let outputs = self.outputs.iter().map(|[name, value]| OutputDef {
            name: (*name).to_owned(),
            value: (*value).to_owned(),
            ..OutputDef::default()
        });
        let (states, outputs) = (states.collect(), outputs.collect());
        let fixed = |step| SolverDef { method: Method::Fixed, step: Some(step), ..SolverDef::default() };
        let solver = self.step.map_or_else(SolverDef::default, fixed);
        let def = EquationsDef { states, outputs, solver, ..EquationsDef::default() };
        let model = EquationsModel::with_constants(&def, &setup.model.constants)?;
        Simulator::new(Box::new(model), setup, NativeModels::NONE)
    }

    fn setup(&self, parameters: &[&str]) -> Setup {
        let text = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let constants: BTreeMap<String, f64> =
            self.constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Setup {
            model: ModelDef { constants, ..ModelDef::default() },
            parameters: text(parameters),
            outputs: self.outputs.iter().map(|[name, _]| (*name).to_owned()).collect(),
            ..Setup::default()
        }
    }

    /// Predictions at the times: rows of outputs, and below them those of their derivatives.
    fn with_slopes(&self, parameters: &[&str], theta: &[f64], times: &[f64]) -> Vec<f64> {
        let setup = Setup { slopes: true, ..self.setup(parameters) };
        let n = self.outputs.len() * (1 + parameters.len());
        let prediction = self.simulator(&setup).unwrap().run(&job(theta, times, n)).unwrap();
        assert_eq!(prediction.state.len(), self.states.len(), "the model's own state is handed on");
        prediction.outputs
    }

    fn plain(&self, parameters: &[&str], theta: &[f64], times: &[f64]) -> Vec<f64> {
        let forward = self.simulator(&self.setup(parameters)).unwrap();
        forward.run(&job(theta, times, self.outputs.len())).unwrap().outputs
    }

    /// Holds the derivatives by each value to central differences of this relative step, to `within` of the largest of them.
    fn compare(&self, parameters: &[&str], theta: &[f64], times: &[f64], (step, within): (f64, f64)) {
        let (n, p) = (self.outputs.len(), parameters.len());
        let found = self.with_slopes(parameters, theta, times);
        let plain = self.plain(parameters, theta, times);
        for (row, values) in plain.chunks(n).zip(found.chunks(n * (1 + p))) {
            for (a, b) in row.iter().zip(values) {
                // Step control sees more states.
                assert!((a - b).abs() < within * a.abs().max(1.0), "{a} and {b}");
            }
        }
        for j in 0..p {
            let moved = |by: f64| {
                let mut theta = theta.to_vec();
                theta[j] += by;
                self.plain(parameters, &theta, times)
            };
            let h = step * theta[j].abs().max(1.0);
            let differences: Vec<f64> =
                moved(h).iter().zip(moved(-h)).map(|(after, before)| (after - before) / (2.0 * h)).collect();
            let size = differences.iter().fold(0.0, |size: f64, d| size.max(d.abs()));
            for (k, expected) in differences.iter().enumerate() {
                let got = found[(k / n) * n * (1 + p) + (1 + j) * n + k % n];
                assert!(
                    (got - expected).abs() < within * size,
                    "{} at {k}: {got}, {expected}",
                    parameters[j]
                );
            }
        }
    }
}

fn job(theta: &[f64], times: &[f64], n_row: usize) -> Job {
    let window = Window::free(0.0, times.to_vec(), n_row, vec![]);
    Job { particle: 0, record: 0, window: Arc::new(window), theta: theta.to_vec(), state: None }
}

fn grid(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|i| i as f64 * step).collect()
}

const DECAY: Written<'_> = Written {
    states: &[["x", "a", "-k*x"]],
    outputs: &[["y", "s*x"], ["z", "x^2 + k"]],
    constants: &[],
    step: None,
};

#[test]
fn of_a_decay_they_are_those_of_the_closed_form() {
    let (a, k, s, times) = (2.0, 0.7, 3.0, grid(9, 0.5));
    let found = DECAY.with_slopes(&["s", "a", "k"], &[s, a, k], &times);
    for (t, row) in times.iter().zip(found.chunks(8)) {
        let x: f64 = a * (-k * t).exp();
        let [of_a, of_k] = [x / a, -t * x];
        let expected = [s * x, x * x + k, x, 0.0, s * of_a, 2.0 * x * of_a, s * of_k, 2.0 * x * of_k + 1.0];
        for (got, expected) in row.iter().zip(expected) {
            // The integrator's tolerance of 1e-8, a few times over.
            assert!((got - expected).abs() < 1e-7, "{got}, {expected} at {t}");
        }
    }
}

#[test]
fn a_given_start_moves_with_its_own_value_alone() {
    let with_start = ["k", "initial:x"];
    let fixed = Written { constants: &[("a", 9.0), ("s", 1.0)], ..DECAY };
    let found = fixed.with_slopes(&with_start, &[0.7, 2.0], &[0.0, 1.0]);
    assert_eq!(found[..6], [2.0, 4.7, 0.0, 1.0, 1.0, 4.0]);
    let x = 2.0 * (-0.7_f64).exp();
    let (of_k, of_start) = (found[8], found[10]);
    assert!((of_k + x).abs() < 1e-7 && (of_start - x / 2.0).abs() < 1e-7, "{found:?}");
}

#[test]
fn of_an_oscillator_with_kinks_and_more_values_than_are_followed_at_once_they_are_differences() {
    let swing = Written {
        states: &[["x", "x0", "v"], ["v", "0", "-k*x - c*v - d*abs(v)*v - s*max(x - g, 0) + q*sin(w*t)"]],
        outputs: &[["y", "x"], ["a", "b + v/k"]],
        constants: &[("w", 1.3)],
        step: None,
    };
    let names = ["k", "c", "d", "s", "g", "q", "x0", "b"];
    swing.compare(&names, &[4.0, 0.2, 0.3, 2.0, 0.2, 1.0, 0.8, 0.1], &grid(20, 0.3), (1e-3, 2e-3));
}

#[test]
fn of_a_stiff_system_they_are_differences() {
    let stiff = Written {
        states: &[["x", "1", "-k*(x - cos(t)) + c*z"], ["z", "0", "x - z"]],
        outputs: &[["y", "x"]],
        constants: &[],
        step: None,
    };
    stiff.compare(&["k", "c"], &[2000.0, 30.0], &grid(10, 0.4), (1e-2, 5e-3));
}

#[test]
fn in_fixed_steps_they_are_the_derivatives_of_what_the_steps_give() {
    let coarse = Written { step: Some(0.5), ..DECAY };
    coarse.compare(&["s", "a", "k"], &[3.0, 2.0, 0.7], &grid(6, 1.0), (1e-5, 1e-9));
}

#[test]
fn what_jumps_or_remembers_has_none_and_says_why() {
    let refused =
        |written: &Written<'_>, setup: Setup| match written.simulator(&Setup { slopes: true, ..setup }) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("it has slopes"),
        };
    let dry = Written { states: &[["x", "1", "-c*sign(x)"]], outputs: &[["y", "x"]], ..DECAY };
    let said = refused(&dry, dry.setup(&["c"]));
    assert!(said.contains("rate of `x` jumps, by `sign`"), "{said}");
    let shown = Written { states: &[["x", "1", "-c*x"]], outputs: &[["y", "if(x > c, 1, 0)"]], ..DECAY };
    assert!(refused(&shown, shown.setup(&["c"])).contains("output `y` jumps"));
    // What only time and constants decide jumps at a time that no value moves.
    let timed = Written {
        states: &[["x", "1", "if(t < t0, 0, -c*x)"]],
        constants: &[("t0", 0.5)],
        outputs: &[["y", "x"]],
        ..DECAY
    };
    timed.compare(&["c"], &[0.8], &grid(5, 0.4), (1e-4, 1e-6));
    let estimated = Written { constants: &[], ..timed };
    assert!(refused(&estimated, estimated.setup(&["c", "t0"])).contains("jumps"));
    let past = Written { states: &[["x", "1", "-c*delay(x, 0.3)"]], outputs: &[["y", "x"]], ..DECAY };
    assert!(refused(&past, past.setup(&["c"])).contains("reads the past of `x`"));
    let started = Written { states: &[["x", "if(a > 1, 1, 2)", "-k*x"]], outputs: &[["y", "x"]], ..DECAY };
    assert!(refused(&started, started.setup(&["a", "k"])).contains("initial value of `x` jumps"));
    let observer = ObserverDef { kind: "nudging".to_owned(), gain: 1.0, ..ObserverDef::default() };
    let watched = Written { outputs: &[["y", "x"]], ..DECAY };
    let setup = Setup { observer, ..watched.setup(&["a", "k"]) };
    assert!(refused(&watched, setup).contains("under an observer"));
    let setup = Setup { periods: vec![1.0], ..watched.setup(&["a", "k"]) };
    assert!(refused(&watched, setup).contains("from a periodic start"));
    let setup = Setup { noise: Some(7), ..watched.setup(&["a", "k"]) };
    assert!(refused(&watched, setup).contains("with noise"));
}
