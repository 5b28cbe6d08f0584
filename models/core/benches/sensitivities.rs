//! What a run with its derivatives costs beside a plain one, as a ratio within one program: where it comes to less than the p + 2 runs of
//! the sigma points, exact slopes are cheaper.
//!
//! `cargo bench -p starlings-models-core --bench sensitivities`
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::disallowed_methods, clippy::disallowed_types)]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use starlings_models_core::equations::{EquationsDef, EquationsModel, OutputDef, StateDef};
use starlings_models_core::{Forward, Job, NativeModels, Setup, Simulator, Window};

/// Pairs of runs; the smallest time of each kind counts.
const ROUNDS: usize = 15;
const SAMPLES: usize = 400;

fn state(name: &str, initial: &str, rate: String) -> StateDef {
    let (name, initial) = (name.to_owned(), initial.to_owned());
    StateDef { rate: vec![(format!("rate {name}"), rate)], name, initial, ..StateDef::default() }
}

/// A chain of masses, each with a stiffness and a drag of its own: n masses, 2 n states, 2 n parameters. `stiff` damps the first.
fn chain(n: usize, stiff: bool) -> (EquationsDef, Vec<String>, Vec<f64>) {
    let (mut states, mut names, mut theta) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let before = if i == 0 { "sin(t)".to_owned() } else { format!("x{}", i - 1) };
        let damping = if stiff && i == 0 { " - 4000*v0" } else { "" };
        states.push(state(&format!("x{i}"), "0.5", format!("v{i}")));
        states.push(state(
            &format!("v{i}"),
            "0",
            format!("k{i}*({before} - x{i}) - d{i}*tanh(v{i}) - 0.1*x{i}^3{damping}"),
        ));
        names.extend([format!("k{i}"), format!("d{i}")]);
        theta.extend([3.0 + 0.3 * i as f64, 0.2 + 0.01 * i as f64]);
    }
    let value = format!("x{}", n - 1);
    let outputs = vec![OutputDef { name: "y".to_owned(), value, ..OutputDef::default() }];
    (EquationsDef { states, outputs, ..EquationsDef::default() }, names, theta)
}

fn seconds(forward: &Simulator, job: &Job) -> f64 {
    let begun = Instant::now();
    black_box(forward.run(black_box(job)).unwrap());
    begun.elapsed().as_secs_f64()
}

/// Times of a run with slopes over those of a plain one, for the first p parameters.
fn ratio((def, names, theta): &(EquationsDef, Vec<String>, Vec<f64>), p: usize) -> f64 {
    let times: Vec<f64> = (1..=SAMPLES).map(|i| 0.05 * i as f64).collect();
    let mut setup =
        Setup { parameters: names[..p].to_vec(), outputs: vec!["y".to_owned()], ..Setup::default() };
    let constants = names.iter().cloned().zip(theta.iter().copied());
    setup.model.constants = constants.skip(p).collect();
    let made = |slopes: bool| {
        let model = EquationsModel::with_constants(def, &setup.model.constants).unwrap();
        let setup = Setup { slopes, ..setup.clone() };
        Simulator::new(Box::new(model), &setup, NativeModels::NONE).unwrap()
    };
    let job = |rows: usize| {
        let window = Arc::new(Window::free(0.0, times.clone(), rows, vec![]));
        Job { particle: 0, record: 0, window, theta: theta[..p].to_vec(), state: None }
    };
    let (plain, with_slopes) = ((made(false), job(1)), (made(true), job(1 + p)));
    let mut best = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        best[0] = best[0].min(seconds(&plain.0, &plain.1));
        best[1] = best[1].min(seconds(&with_slopes.0, &with_slopes.1));
    }
    best[1] / best[0]
}

fn main() {
    println!(
        "| states | parameters p | plain runs that a run with slopes takes | runs of an ensemble, p + 2 | stiff: plain runs |"
    );
    println!("|---|---|---|---|---|");
    for (n, all) in [(1, vec![1, 2]), (4, vec![2, 4, 8]), (8, vec![4, 8, 16])] {
        for p in all {
            let [usual, stiff] = [false, true].map(|stiff| ratio(&chain(n, stiff), p));
            println!("| {} | {p} | {usual:.1} | {} | {stiff:.1} |", 2 * n, p + 2);
        }
    }
}
