//! Valves, losses and shifted sources: balances, events, and the same bits however a run is cut.
#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod common;
mod rcr_network_kit;

use std::f64::consts::PI;

use common::{run, run_in_pieces};
use rcr_network_kit::{beat, everything, flow_in, grid, network, over, signal, simulate};
use serde_json::json;
use starlings_models::{BuildSetup, Setup, Signal};

#[test]
fn a_half_wave_rectifier_passes_the_positive_halves() {
    let (open, closed, load) = (0.01, 1e4, 1.0);
    let setup = network(
        json!({ "elements": [
            { "name": "heart", "kind": "pressure", "to": "in", "input": "pressure" },
            { "name": "valve", "kind": "diode", "from": "in", "to": "out", "open": open, "closed": closed },
            { "name": "load", "kind": "R", "from": "out", "value": load },
        ]}),
        &[],
    );
    let times = grid(64, 2.0);
    let got = simulate(&setup, &times, vec![signal(&times, |t| 10.0 * (2.0 * PI * t).sin())]);
    for (i, t) in times.iter().enumerate() {
        let drive = 10.0 * (2.0 * PI * t).sin();
        let want = drive / (load + if drive > 0.0 { open } else { closed });
        // An algebraic network: Newton's method ends at rounding.
        assert!((got["q_load"][i] - want).abs() < 1e-13, "{t}: {} against {want}", got["q_load"][i]);
    }
}

#[test]
fn a_charged_capacitor_behind_a_valve_switches_where_the_pressures_cross() {
    // A ramp from 0 to 100 fills a capacitor that starts at 40 through a valve: it opens at t = 0.4.
    let (open, c) = (0.05, 0.8);
    let setup = network(
        json!({ "elements": [
            { "name": "heart", "kind": "pressure", "to": "in", "input": "pressure" },
            { "name": "valve", "kind": "diode", "from": "in", "to": "aorta", "open": open, "closed": 1e9 },
            { "name": "wall", "kind": "C", "from": "aorta", "value": c, "initial": 40.0 },
        ]}),
        &[],
    );
    let times = grid(10, 1.0);
    let got = simulate(&setup, &times, vec![signal(&[0.0, 1.0], |t| 100.0 * t)]);
    let tau = open * c;
    for (t, p) in times.iter().zip(&got["p_aorta"]) {
        let since = (t - 0.4_f64).max(0.0);
        let want = 40.0 + 100.0 * (since - tau * (1.0 - (-since / tau).exp()));
        // The leak of the closed valve, 40 / (1e9 · 0.8) a second, and the integrator's tolerance of 1e-8.
        assert!((p - want).abs() < 3e-6, "{t}: {p} against {want}");
    }
}

#[test]
fn a_smooth_valve_tends_to_the_sharp_one() {
    let ejected = |smooth: f64| {
        let setup = network(
            json!({ "elements": [
                { "name": "heart", "kind": "pressure", "to": "in", "input": "pressure" },
                { "name": "valve", "kind": "diode", "from": "in", "to": "aorta", "open": 0.02, "closed": 1e5,
                  "smooth": smooth },
                { "name": "wall", "kind": "C", "from": "aorta", "value": 1.0, "initial": 80.0 },
                { "name": "body", "kind": "R", "from": "aorta", "value": 1.0 },
            ]}),
            &[],
        );
        let times = grid(80, 1.6);
        let got = simulate(&setup, &times, vec![signal(&times, |t| 120.0 * (4.0 * t).sin())]);
        got["p_aorta"].clone()
    };
    let sharp = ejected(0.0);
    let off = |smooth| common::largest_difference(&ejected(smooth), &sharp);
    let (wide, narrow) = (off(2.0), off(0.02));
    // While the flow is positive the drop of the smooth valve is half its width larger.
    assert!(wide > 0.05 && wide < 1.2, "{wide}");
    assert!(narrow < 0.012, "{narrow}");
}

#[test]
fn a_valve_that_shuts_tightly_before_an_inertance_is_run_and_lets_nothing_back() {
    // A ventricle, the aortic valve with the inertance of its blood, the aorta and the body.
    let aorta = |closed: f64, inertance: f64| {
        let setup = network(
            json!({ "elements": [
                { "name": "heart", "kind": "pressure", "to": "lv", "input": "pressure" },
                { "name": "valve", "kind": "diode", "from": "lv", "to": "root", "open": 0.01, "closed": closed },
                { "name": "blood", "kind": "L", "from": "root", "to": "aorta", "value": inertance },
                { "name": "wall", "kind": "C", "from": "aorta", "value": 0.1, "initial": 80.0 },
                { "name": "body", "kind": "rcr", "from": "aorta", "proximal": 0.05, "compliance": 1.3, "distal": 1.0 },
            ]}),
            &[],
        );
        let squeeze = |t: f64| {
            let phase = t.rem_euclid(0.8);
            5.0 + if phase < 0.35 { 120.0 * (PI * phase / 0.35).sin().powi(2) } else { 0.0 }
        };
        let times = grid(800, 1.6);
        simulate(&setup, &times, vec![signal(&times, squeeze)])["p_aorta"].clone()
    };
    for inertance in [5e-4, 2e-3] {
        let leaking = aorta(1e4, inertance);
        for closed in [1e5, 1e6] {
            // 120 mmHg back through 1e4 for 1.6 s are 0.02 ml, in a compliance of 1.4.
            let off = common::largest_difference(&aorta(closed, inertance), &leaking);
            assert!(off < 0.02, "{closed:e} before {inertance:e}: {off}");
        }
    }
}

#[test]
fn a_quadratic_loss_at_rest_balances_inflow_and_pressure_drop() {
    let (kv, kq, rd) = (0.05, 2e-3, 0.9);
    let setup = network(
        json!({ "elements": [flow_in("asc"),
            { "name": "wall", "kind": "C", "from": "asc", "value": 0.5 },
            { "name": "coarctation", "kind": "loss", "from": "asc", "to": "desc", "linear": kv, "quadratic": kq },
            { "name": "body", "kind": "rcr", "from": "desc", "proximal": 0.1, "compliance": 0.8, "distal": rd,
              "venous": 5.0 }] }),
        &[],
    );
    let got = simulate(&setup, &[60.0], vec![signal(&[0.0, 60.0], |_| 80.0)]);
    let drop = kv * 80.0 + kq * 80.0 * 80.0;
    // Sixty time constants: what is left is the integrator's tolerance on pressures of about 100.
    assert!((got["dp_coarctation"][0] - drop).abs() < 1e-5, "{:?}", got["dp_coarctation"]);
    assert!((got["p_asc"][0] - (5.0 + 80.0 * (0.1 + rd) + drop)).abs() < 1e-5, "{:?}", got["p_asc"]);
}

#[test]
fn the_flows_of_every_node_add_up_to_nothing() {
    let layout = everything();
    let setup = network(layout.clone(), &[("C_wall", 0.3)]);
    let (times, samples) = (grid(80, 1.6), grid(170, 1.7));
    let inputs = vec![
        signal(&samples, |t| 90.0 - 60.0 * (PI * t / 0.8).sin()),
        signal(&samples, |t| 55.0 * (1.0 - (2.0 * PI * t / 0.8).cos())),
    ];
    let got = simulate(&setup, &times, inputs);
    let elements = layout["elements"].as_array().unwrap();
    assert!(got["q_valve"].iter().any(|q| *q > 20.0) && got["dp_valve"].iter().any(|p| *p < -1.0));
    for node in ["lv", "root", "asc", "arch", "desc"] {
        for (i, t) in times.iter().enumerate() {
            let at = |end: &'static str, sign: f64| {
                elements.iter().filter(move |e| e[end] == node).map(move |e| (e, sign))
            };
            let flows = at("from", 1.0).chain(at("to", -1.0)).map(|(e, sign)| {
                let q = got[&format!("q_{}", e["name"].as_str().unwrap())][i];
                (sign * q, q.abs())
            });
            let (sum, size) = flows.fold((0.0, 0.0_f64), |(a, b), (c, d)| (a + c, b.max(d)));
            // Rounding of pressures of 100 over a resistance of 0.01, relative to flows of 100.
            assert!(sum.abs() <= 1e-12 * size.max(1e2), "{node} at {t}: {sum:e} of {size}");
        }
    }
}

#[test]
fn a_network_with_valves_run_in_pieces_gives_the_bits_of_one_run() {
    let setup = network(everything(), &[("C_wall", 0.3)]);
    let samples = grid(170, 1.7);
    let inputs = vec![
        signal(&samples, |t| 90.0 - 60.0 * (PI * t / 0.8).sin()),
        signal(&samples, |t| 55.0 * (1.0 - (2.0 * PI * t / 0.8).cos())),
    ];
    let window = over(&setup, grid(40, 1.6)[1..].to_vec(), inputs);
    let model = setup.build().unwrap();
    let whole = run(&*model, &window, &[]);
    for every in [1, 7] {
        assert_eq!(run_in_pieces(&*model, &window, &[], every), whole);
    }
}

#[test]
fn steep_and_flat_laws_in_series_are_solved_from_anywhere() {
    // Losses without much linear part and closed valves: conductances from 1e-6 to 1e6 in one chain.
    for drive in [-300.0, -1e-6, 1e-3, 5.0, 1e4] {
        let setup = network(
            json!({ "elements": [
                { "name": "heart", "kind": "pressure", "to": "a", "value": drive },
                { "name": "one", "kind": "loss", "from": "a", "to": "b", "linear": 1e-6, "quadratic": 1e-3 },
                { "name": "two", "kind": "diode", "from": "b", "to": "c", "open": 1e-3, "closed": 1e6 },
                { "name": "three", "kind": "loss", "from": "c", "to": "d", "linear": 1e-4, "quadratic": 10.0 },
                { "name": "four", "kind": "R", "from": "d", "value": 0.5 },
                { "name": "leak", "kind": "R", "from": "c", "value": 1e5 },
            ]}),
            &[],
        );
        let got = simulate(&setup, &[0.0], vec![]);
        let q = |name: &str| got[&format!("q_{name}")][0];
        let size = q("one").abs();
        assert!(q("four") * drive > 0.0, "{drive}: {got:?}");
        for (a, b) in [(q("one"), q("two")), (q("two"), q("three") + q("leak")), (q("three"), q("four"))] {
            // Rounding of the pressure over the steepest conductance.
            assert!((a - b).abs() <= 1e-8 * size + 1e-15 * drive.abs() * 1e6, "{drive}: {a:e} and {b:e}");
        }
    }
}

fn shifted(shift: f64) -> Setup {
    network(
        json!({ "tolerance": 1e-9, "elements": [
            { "name": "inflow", "kind": "flow", "to": "aorta", "shift": shift },
            { "name": "coarctation", "kind": "loss", "from": "aorta", "to": "desc", "linear": 0.03, "quadratic": 5e-4 },
            { "name": "wall", "kind": "C", "from": "aorta", "value": 0.4 },
            { "name": "body", "kind": "rcr", "from": "desc", "proximal": 0.06, "compliance": 1.3, "distal": 0.95 }] }),
        &[],
    )
}

#[test]
fn a_shifted_source_is_the_source_of_a_shifted_record_whatever_the_sign() {
    let (times, samples) = (grid(50, 2.0), grid(200, 4.0));
    for shift in [0.033, 0.0, -0.047] {
        let earlier: Vec<f64> = samples.iter().map(|t| t - 1.0).collect();
        let moved: Vec<f64> = earlier.iter().map(|t| t + shift).collect();
        let got = simulate(&shifted(shift), &times, vec![signal(&earlier, beat)]);
        let record = Signal { times: moved, values: earlier.iter().map(|t| beat(*t)).collect() };
        let want = simulate(&shifted(0.0), &times, vec![record]);
        for name in ["p_aorta", "q_body", "q_inflow"] {
            // The integrator's tolerance of 1e-9 on pressures of 100, over a resistance of 0.06.
            let difference = common::largest_difference(&got[name], &want[name]);
            assert!(difference < 2e-5, "{name} shifted by {shift}: {difference:e}");
        }
    }
}

#[test]
fn a_shifted_source_run_in_pieces_gives_the_bits_of_one_run() {
    let samples: Vec<f64> = grid(200, 4.0).iter().map(|t| t - 1.0).collect();
    let setup = shifted(-0.047);
    let window = over(&setup, grid(30, 1.5)[1..].to_vec(), vec![signal(&samples, beat)]);
    let model = setup.build().unwrap();
    let whole = run(&*model, &window, &[]);
    assert_eq!(run_in_pieces(&*model, &window, &[], 4), whole);
}
