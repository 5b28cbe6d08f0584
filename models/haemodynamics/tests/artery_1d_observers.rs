//! The displacement and the Windkessel observer on nonlinear vessels: their errors decay as the spectrum of the linearisation says.
#![allow(clippy::unwrap_used)]

mod artery_1d_kit;

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_models_core::observer::{self, Wiring};
use starlings_models_core::spectrum::linearisation;
use starlings_models_core::{
    Forward, Job, Model, ModelDef, NativeModels, ObserverDef, Setup, Signal, Simulator, Window,
};

/// Pressure at which everything rests, in dyn/cm².
const REST: f64 = 1e5;
/// Spacing of the data in s, small against the gains.
const STEP: f64 = 1e-3;
const N: usize = 600;

fn observers(list: &[(&str, f64)]) -> ObserverDef {
    let def = |(kind, gain): &(&str, f64)| ObserverDef {
        kind: (*kind).to_owned(),
        gain: *gain,
        ..ObserverDef::default()
    };
    let mut all = list.iter().map(def);
    let first = all.next().unwrap_or_default();
    ObserverDef { beside: all.collect(), ..first }
}

fn outputs() -> Vec<String> {
    ["displacement", "outlet_pressure", "pi"].map(str::to_owned).into()
}

/// Rows of a run that begins at rest under `p0`: 20 displacements, the outlet's pressure and the Windkessel's, at every time.
fn run(list: &[(&str, f64)], p0: f64, observed: Option<&[f64]>) -> Vec<f64> {
    let constants = [("p_venous".to_owned(), REST)].into();
    let setup = Setup {
        model: ModelDef { kind: "artery-1d".to_owned(), constants, ..ModelDef::default() },
        parameters: vec!["p0".to_owned()],
        outputs: outputs(),
        observer: observers(list),
        ..Setup::default()
    };
    let model = artery_1d_kit::tube(20, 5, 0.8);
    let simulator = Simulator::new(Box::new(model), &setup, NativeModels::NONE).unwrap();
    let times: Vec<f64> = (1..=N).map(|k| STEP * k as f64).collect();
    let mut seen = observed.map_or_else(|| vec![f64::NAN; 22 * N], <[f64]>::to_vec);
    // The stored pressure is not measured.
    seen.iter_mut().skip(21).step_by(22).for_each(|value| *value = f64::NAN);
    let flow = Signal { times: vec![0.0, 1.0], values: vec![0.0; 2] };
    let window = Arc::new(Window { start: 0.0, times, observed: seen, inputs: vec![flow], since: vec![] });
    simulator.run(&Job { particle: 0, record: 0, window, theta: vec![p0], state: None }).unwrap().outputs
}

/// The poles of A − Γ at rest, by a dense eigenvalue problem; the real parts, slowest first.
fn slowest(list: &[(&str, f64)]) -> [(f64, f64); 2] {
    let model = artery_1d_kit::tube(20, 5, 0.8);
    let theta = artery_1d_kit::theta(&model, &[("p0", REST), ("p_venous", REST)]);
    let mut a: DMatrix<f64> = linearisation(&model, &theta).unwrap();
    if !list.is_empty() {
        let outputs = outputs();
        let wiring = Wiring {
            spec: model.spec(),
            outputs: &outputs,
            model: &model,
            theta: &theta,
            native: NativeModels::NONE,
        };
        a -= observer::build(&observers(list), wiring).unwrap().feedback(&model, &theta);
    }
    let mut poles: Vec<(f64, f64)> = a.complex_eigenvalues().iter().map(|z| (z.re, z.im.abs())).collect();
    poles.sort_by(|a, b| b.0.total_cmp(&a.0));
    [poles[0], poles[1]]
}

/// Decay rates in 1/s of an error of 100 dyn/cm² everywhere, in the stored pressure between 0.3 and 0.6 s.
fn decay(list: &[(&str, f64)]) -> f64 {
    let truth = run(&[], REST, None);
    let off = run(list, REST + 100.0, Some(&truth));
    let error = |k: usize| (off[22 * (k - 1) + 21] - truth[22 * (k - 1) + 21]).abs();
    (error(300) / error(600)).ln() / (STEP * 300.0)
}

#[test]
fn errors_decay_with_the_slowest_pole_of_the_linearisation_under_one_observer_and_under_the_pair() {
    let mut rates = Vec::new();
    for list in [&[][..], &[("sdf", 20.0)], &[("windkessel", 5.0)], &[("sdf", 20.0), ("windkessel", 5.0)]] {
        let [(first, turn), (second, _)] = slowest(list);
        assert!(turn == 0.0 && second < 1.5 * first, "{list:?}: one slow pole: {first} {turn} {second}");
        let rate = decay(list);
        // Steps of first order, γΔt up to 0.02, and what is left of the faster poles after 0.3 s.
        assert!((rate / -first - 1.0).abs() < 0.05, "{list:?}: {rate} for {first}");
        rates.push(rate);
    }
    // Left alone the vessel empties with its Windkessel; either observer is faster, the pair fastest.
    assert!(rates[1] > 2.0 * rates[0] && rates[2] > 2.0 * rates[0], "{rates:?}");
    assert!(rates[3] > rates[1].max(rates[2]), "{rates:?}");
}

#[test]
fn the_true_state_is_left_alone_and_a_ring_that_is_not_seen_too() {
    let truth = run(&[], REST, None);
    let kept = run(&[("sdf", 50.0), ("windkessel", 5.0)], REST, Some(&truth));
    let moved = truth.iter().zip(&kept).map(|(a, b)| (a - b).abs() / a.abs().max(1.0)).fold(0.0, f64::max);
    // Rounding of a square root.
    assert!(moved < 1e-12, "{moved}");
    let model = artery_1d_kit::tube(20, 5, 0.8);
    let theta = artery_1d_kit::theta(&model, &[]);
    let outputs = ["displacement[3]".to_owned(), "outlet_pressure".to_owned()];
    let wiring = Wiring {
        spec: model.spec(),
        outputs: &outputs,
        model: &model,
        theta: &theta,
        native: NativeModels::NONE,
    };
    let built = observer::build(&observers(&[("sdf", 4.0)]), wiring).unwrap();
    let feedback = built.feedback(&model, &theta);
    assert!((feedback.sum() - 4.0).abs() < 1e-15 && (feedback[(3, 3)] - 4.0).abs() < 1e-15);
    let none = Wiring { outputs: &outputs[1..], ..wiring };
    let told = observer::build(&observers(&[("sdf", 4.0)]), none).err().unwrap().to_string();
    assert!(told.contains("needs the output `displacement` observed"), "{told}");
    let none = Wiring { outputs: &outputs[..1], ..wiring };
    let told = observer::build(&observers(&[("windkessel", 4.0)]), none).err().unwrap().to_string();
    assert!(told.contains("needs the output `outlet_pressure` observed"), "{told}");
}
