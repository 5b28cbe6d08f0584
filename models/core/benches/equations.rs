//! What it costs that a model is written in a study: whole runs of equations against the same model in Rust, as ratios within one
//! program, so that the load of the machine cancels. Both go through the same integrator to the same tolerance.
//!
//! `cargo bench -p starlings-models-core --bench equations`
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::disallowed_methods, clippy::disallowed_types)]

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

use starlings_models_core::effect::{Addition, EffectDef, EffectParameter, Extended};
use starlings_models_core::equations::{EquationsDef, EquationsModel, InputDef, StateDef};
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{Drive, History, Segment};
use starlings_models_core::{Model, Quantity, Spec};

/// Samples of a recording, and the spacing of its input.
const SAMPLES: usize = 3000;
const STEP: f64 = 0.02;
/// Pairs of runs; the smallest time of each kind counts.
const ROUNDS: usize = 30;

struct Sines;

impl History for Sines {
    fn at(&self, _: usize, t: f64) -> f64 {
        t.sin()
    }
}

/// x'' = −k x − c x' − s x³ + u, with or without −d |x'| x'.
struct Oscillator {
    spec: Spec,
    has_drag: bool,
}

impl Oscillator {
    fn new(has_drag: bool) -> Self {
        let list = |names: &[&str]| names.iter().map(|name| Quantity::new(name, "")).collect::<Vec<_>>();
        let parameters = list(if has_drag { &["k", "c", "s", "d"] } else { &["k", "c", "s"] });
        let (states, inputs) = (list(&["x", "v"]), list(&["u"]));
        Self { spec: Spec { states, inputs, parameters, ..Spec::default() }, has_drag }
    }
}

impl Model for Oscillator {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _: &[f64], x: &mut [f64]) {
        x.copy_from_slice(&[1.0, 0.0]);
    }

    fn rhs(&self, _: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        dx[0] = x[1];
        dx[1] = -theta[0] * x[0] - theta[1] * x[1] - theta[2] * (x[0] * x[0] * x[0]) + u.value[0];
        if self.has_drag {
            dx[1] -= theta[3] * x[1].abs() * x[1];
        }
    }

    fn output(&self, _: f64, _: &[f64], _: &[f64], _: Drive<'_>, _: &mut [f64]) {}

    fn n_switch(&self) -> usize {
        usize::from(self.has_drag)
    }

    fn switches(&self, _: f64, x: &[f64], _: &[f64], _: Drive<'_>, g: &mut [f64]) {
        if self.has_drag {
            g[0] = x[1];
        }
    }
}

fn written() -> EquationsModel {
    let state = |name: &str, initial: &str, rate: &str| StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![("rate".to_owned() + name, rate.to_owned())],
        ..StateDef::default()
    };
    let states = vec![state("x", "1", "v"), state("v", "0", "-k*x - c*v - s*x^3 + u")];
    let inputs = vec![InputDef { name: "u".to_owned(), ..InputDef::default() }];
    EquationsModel::new(&EquationsDef { states, inputs, ..EquationsDef::default() }).unwrap()
}

fn with_drag() -> Extended {
    let drag = EffectDef {
        name: "drag".to_owned(),
        adds: vec![Addition { to: "v".to_owned(), term: "-d*abs(v)*v".to_owned() }],
        parameters: vec![EffectParameter { name: "d".to_owned(), ..EffectParameter::default() }],
        ..EffectDef::default()
    };
    Extended::new(Box::new(written()), &[drag], &BTreeMap::new()).unwrap()
}

/// A run over all samples, each span between two of them with an input of its own; the seconds it took and where it ended.
fn run(model: &dyn Model, theta: &[f64]) -> (f64, Vec<f64>) {
    let mut x = vec![0.0; 2];
    model.initial(theta, &mut x);
    let limits = Limits::none();
    let begun = Instant::now();
    for k in 0..SAMPLES {
        let (t0, t1) = (k as f64 * STEP, (k + 1) as f64 * STEP);
        let (u0, slope) = ([t0.sin()], [(t1.sin() - t0.sin()) / STEP]);
        let segment =
            Segment { t0, t1, u0: &u0, slope: &slope, history: &Sines, limits: &limits, noise: None };
        model.advance(segment, theta, &mut x).unwrap();
    }
    (begun.elapsed().as_secs_f64(), x)
}

/// Seconds of a run of each, the smallest of many that alternate.
fn compared(what: &str, model: &dyn Model, native: &dyn Model, theta: &[f64]) {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        let (seconds, x) = run(black_box(model), theta);
        let (of_native, y) = run(black_box(native), theta);
        best = [best[0].min(seconds), best[1].min(of_native)];
        assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-6), "{x:?} against {y:?}");
    }
    let [seconds, of_native] = best;
    println!(
        "{what}: {:.2} times Rust ({:.0} against {:.0} ns a sample)",
        seconds / of_native,
        1e9 * seconds / SAMPLES as f64,
        1e9 * of_native / SAMPLES as f64
    );
}

fn main() {
    let theta = [4.0, 0.3, 0.1, 0.2];
    compared("equations", &written(), &Oscillator::new(false), &theta[..3]);
    compared("equations with an effect", &with_drag(), &Oscillator::new(true), &theta);
}
