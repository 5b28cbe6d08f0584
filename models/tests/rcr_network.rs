//! Networks against closed forms, other models and balances.
#![allow(clippy::float_cmp)]

mod common;

use std::collections::BTreeMap;
use std::f64::consts::PI;

use common::{job, run, run_in_pieces};
use serde_json::{Value, json};
use starlings_models::{ModelDef, Prediction, Setup, Signal, Window};

/// A setup of a netlist that predicts every output, all values being numbers or constants.
fn network(layout: Value, constants: &[(&str, f64)]) -> Setup {
    let constants: BTreeMap<String, f64> = constants.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
    let kind = "rcr-network".to_owned();
    let model = ModelDef { kind, constants, layout: Some(layout), ..ModelDef::default() };
    let mut setup = Setup { model, ..Setup::default() };
    setup.outputs = setup.spec().unwrap().outputs.iter().map(|q| q.name.clone()).collect();
    setup
}

fn signal(times: &[f64], value: impl Fn(f64) -> f64) -> Signal {
    Signal { times: times.to_vec(), values: times.iter().map(|t| value(*t)).collect() }
}

fn grid(n: usize, end: f64) -> Vec<f64> {
    (0..=n).map(|i| end * i as f64 / n as f64).collect()
}

fn over(setup: &Setup, times: Vec<f64>, inputs: Vec<Signal>) -> Window {
    let observed = vec![f64::NAN; times.len() * setup.outputs.len()];
    Window { start: 0.0, times, observed, inputs }
}

/// The series of one output.
fn series(setup: &Setup, prediction: &Prediction, name: &str) -> Vec<f64> {
    let row = setup.outputs.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}"));
    prediction.outputs.iter().skip(row).step_by(setup.outputs.len()).copied().collect()
}

fn simulate(setup: &Setup, times: &[f64], inputs: Vec<Signal>) -> BTreeMap<String, Vec<f64>> {
    let window = over(setup, times.to_vec(), inputs);
    let prediction = run(&*setup.build().unwrap(), &window, &[]);
    setup.outputs.iter().map(|name| (name.clone(), series(setup, &prediction, name))).collect()
}

fn flow_in(to: &str) -> Value {
    json!({ "name": "inflow", "kind": "flow", "to": to })
}

fn beat(t: f64) -> f64 {
    let phase = t.rem_euclid(0.8);
    if phase < 0.3 { 420.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

#[test]
fn a_capacitor_that_empties_through_a_resistance_decays_exponentially() {
    let setup = network(
        json!({ "nodes": [{ "name": "a", "initial": 100.0 }], "elements": [
            { "name": "wall", "kind": "C", "from": "a", "value": 0.5 },
            { "name": "out", "kind": "R", "from": "a", "value": 1.6 },
        ]}),
        &[],
    );
    let times = grid(20, 4.0);
    let got = simulate(&setup, &times, vec![]);
    for (t, (p, q)) in times.iter().zip(got["p_a"].iter().zip(&got["q_out"])) {
        let want = 100.0 * (-t / 0.8).exp();
        // The step is a matrix exponential: rounding of twenty steps.
        assert!((p - want).abs() < 1e-12 * 100.0, "{t}: {p} against {want}");
        assert!((q - want / 1.6).abs() < 1e-12 * 100.0, "{t}");
    }
}

#[test]
fn a_resistance_an_inertance_and_a_capacitor_ring_at_their_own_frequency() {
    let (r, l, c) = (0.1, 0.02, 0.5);
    let setup = network(
        json!({ "elements": [
            { "name": "source", "kind": "pressure", "to": "in", "value": 90.0 },
            { "name": "drag", "kind": "R", "from": "in", "to": "mid", "value": r },
            { "name": "blood", "kind": "L", "from": "mid", "to": "out", "value": l },
            { "name": "wall", "kind": "C", "from": "out", "value": c, "initial": 60.0 },
        ]}),
        &[],
    );
    let times = grid(50, 2.0);
    let got = simulate(&setup, &times, vec![]);
    let (damping, natural): (f64, f64) = (r / (2.0 * l), 1.0 / (l * c));
    let ringing = (natural - damping * damping).sqrt();
    for (t, p) in times.iter().zip(&got["p_out"]) {
        let shape = (ringing * t).cos() + damping / ringing * (ringing * t).sin();
        let want = 90.0 - 30.0 * (-damping * t).exp() * shape;
        // Rounding of fifty steps.
        assert!((p - want).abs() < 1e-11, "{t}: {p} against {want}");
    }
}

#[test]
fn an_rcr_element_is_the_three_element_windkessel() {
    let setup = network(
        json!({ "elements": [flow_in("aorta"),
            { "name": "body", "kind": "rcr", "from": "aorta", "proximal": 0.06, "compliance": 1.3, "distal": 0.95 }] }),
        &[],
    );
    let mut windkessel = Setup::default();
    windkessel.model.kind = "windkessel-3".to_owned();
    windkessel.model.constants =
        [("R", 0.95), ("C", 1.3), ("Zc", 0.06)].map(|(n, v)| (n.to_owned(), v)).into();
    windkessel.outputs = vec!["pressure".to_owned()];
    let (times, samples) = (grid(160, 8.0), grid(900, 9.0));
    let inflow = signal(&samples, beat);
    let got = simulate(&setup, &times, vec![inflow.clone()]);
    let window = over(&windkessel, times, vec![inflow]);
    let want = run(&*windkessel.build().unwrap(), &window, &[]).outputs;
    let difference = common::largest_difference(&got["p_aorta"], &want);
    // Both are exact; ten thousand steps of rounding at pressures of 100.
    assert!(difference < 1e-10, "{difference:e}");
}

#[test]
fn a_linear_network_with_very_different_time_constants_takes_the_exact_step() {
    // A microsecond beside a second.
    let setup = network(
        json!({ "elements": [
            { "name": "fast", "kind": "C", "from": "a", "value": 1e-3, "initial": 50.0 },
            { "name": "link", "kind": "R", "from": "a", "to": "b", "value": 1e-3 },
            { "name": "slow", "kind": "C", "from": "b", "value": 1.0, "initial": 100.0 },
            { "name": "out", "kind": "R", "from": "b", "value": 1.0 },
        ]}),
        &[],
    );
    let got = simulate(&setup, &[0.5], vec![]);
    // Eigenvalues of the two-capacitor system and their share of the start, from its characteristic polynomial.
    let [fast, slow, link, out]: [f64; 4] = [1e-3, 1.0, 1e-3, 1.0];
    let (a, b) = (1.0 / (fast * link), 1.0 / (slow * link));
    let sum = a + b + 1.0 / (slow * out);
    let root = (sum * sum - 4.0 * a / (slow * out)).sqrt();
    let (quick, lasting) = (-0.5 * (sum + root), -2.0 * a / (slow * out) / (sum + root));
    // p_b = k₁ e^{λ₁ t} + k₂ e^{λ₂ t} with the start's value and rate.
    let rate = b * (50.0 - 100.0) - 100.0;
    let share = (rate - quick * 100.0) / (lasting - quick);
    let want = share * (lasting * 0.5).exp() + (100.0 - share) * (quick * 0.5).exp();
    // Twenty squarings of the exponential multiply rounding by a million at most.
    assert!((got["p_b"][0] - want).abs() < 1e-8, "{} against {want}", got["p_b"][0]);
}

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

/// A network with every kind of element, with nodes that store nothing.
fn everything() -> Value {
    json!({
        "nodes": [{ "name": "lv", "initial": 10.0 }, { "name": "root" }, { "name": "asc", "initial": 70.0 },
                  { "name": "arch" }, { "name": "desc" }, { "name": "vein" }],
        "elements": [
            { "name": "filling", "kind": "flow", "to": "lv" },
            { "name": "ventricle", "kind": "C", "from": "lv", "value": 0.8, "input": "squeeze" },
            { "name": "valve", "kind": "diode", "from": "lv", "to": "root", "open": 0.02, "closed": 1e4 },
            { "name": "annulus", "kind": "R", "from": "root", "to": "asc", "value": 0.01 },
            { "name": "wall", "kind": "C", "from": "asc", "value": "C_wall" },
            { "name": "wall2", "kind": "C", "from": "0", "to": "asc", "value": "C_wall" },
            { "name": "blood", "kind": "L", "from": "asc", "to": "arch", "value": 0.002 },
            { "name": "coarctation", "kind": "loss", "from": "arch", "to": "desc", "linear": 0.02, "quadratic": 4e-4 },
            { "name": "head", "kind": "rcr", "from": "asc", "proximal": 0.3, "compliance": 0.2, "distal": 3.0 },
            { "name": "legs", "kind": "rcr", "from": "desc", "to": "vein", "proximal": 0.1, "compliance": 0.6, "distal": 1.2 },
            { "name": "coupling", "kind": "C", "from": "arch", "to": "desc", "value": 0.001 },
            { "name": "veins", "kind": "pressure", "to": "vein", "value": 6.0 },
        ],
    })
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
        for i in 0..times.len() {
            let at = |end: &'static str, sign: f64| {
                elements.iter().filter(move |e| e[end] == node).map(move |e| (e, sign))
            };
            let flows = at("from", 1.0).chain(at("to", -1.0)).map(|(e, sign)| {
                let q = got[&format!("q_{}", e["name"].as_str().unwrap())][i];
                (sign * q, q.abs())
            });
            let (sum, size) = flows.fold((0.0, 0.0_f64), |(a, b), (c, d)| (a + c, b.max(d)));
            // Rounding of pressures of 100 over a resistance of 0.01, relative to flows of 100.
            assert!(sum.abs() <= 1e-12 * size.max(1e2), "{node} at {i}: {sum:e} of {size}");
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
fn a_bridge_without_capacitors_is_solved_at_once() {
    let bridge = |last: f64| {
        network(
            json!({ "elements": [
                { "name": "source", "kind": "pressure", "to": "top", "value": 10.0 },
                { "name": "a", "kind": "R", "from": "top", "to": "left", "value": 1.0 },
                { "name": "b", "kind": "R", "from": "top", "to": "right", "value": 2.0 },
                { "name": "c", "kind": "R", "from": "left", "value": 3.0 },
                { "name": "d", "kind": "R", "from": "right", "value": last },
                { "name": "middle", "kind": "R", "from": "left", "to": "right", "value": 5.0 },
            ]}),
            &[],
        )
    };
    let got = simulate(&bridge(6.0), &[0.0, 1.0], vec![]);
    // Balanced: 1 : 3 = 2 : 6. Rounding of a linear solve.
    assert!(got["q_middle"][1].abs() < 1e-14 && (got["p_left"][1] - 7.5).abs() < 1e-14);
    let got = simulate(&bridge(2.0), &[0.0], vec![]);
    // Cramer's rule: (1 + 1/3 + 1/5) l − r/5 = 10 and −l/5 + (1/2 + 1/2 + 1/5) r = 5.
    let (a, b, c) = (1.0 + 1.0 / 3.0 + 0.2, 0.2, 1.2);
    let left = (10.0 * c + 5.0 * b) / (a * c - b * b);
    assert!((got["p_left"][0] - left).abs() < 1e-14, "{:?} against {left}", got["p_left"]);
    assert!((got["q_source"][0] - got["q_a"][0] - got["q_b"][0]).abs() < 1e-14);
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
        json!({ "elements": [
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
            // The integrator's tolerance of 1e-8 on pressures of 100, over a resistance of 0.06.
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

#[test]
fn elements_share_a_parameter_by_its_name_and_a_number_is_a_default() {
    let setup = network(everything(), &[("C_wall", 0.3)]);
    let spec = setup.spec().unwrap();
    let find = |name: &str| spec.parameters.iter().filter(|q| q.name == name).collect::<Vec<_>>();
    assert_eq!(find("C_wall").len(), 1);
    assert_eq!(find("C_wall")[0].default, None);
    assert_eq!(find("Rp_legs")[0].default, Some(0.1));
    assert_eq!(
        (find("Rp_legs")[0].unit.as_str(), find("Kq_coarctation")[0].unit.as_str()),
        ("mmHg s/mL", "mmHg s^2/mL^2")
    );
    assert!(find("Pv_legs").is_empty() && find("Pv_head")[0].default == Some(0.0));
    let states: Vec<&str> = spec.states.iter().map(|q| q.name.as_str()).collect();
    assert_eq!(states, ["p_lv", "p_asc", "q_blood", "p_head", "p_legs", "v_coupling"]);
    let x0: Vec<f64> = spec.states.iter().map(|q| q.default.unwrap()).collect();
    assert_eq!(x0, [10.0, 70.0, 0.0, 80.0, 80.0, 0.0]);
}

#[test]
fn labels_follow_the_system_of_units() {
    for (units, resistance, pressure) in [("cgs", "dyn s/cm^5", "dyn/cm^2"), ("SI", "Pa s/m^3", "Pa")] {
        let layout = json!({ "units": units, "elements": [flow_in("a"),
            { "name": "body", "kind": "rcr", "from": "a", "proximal": 1.0, "compliance": 1.0, "distal": 1.0 }] });
        let spec = network(layout, &[]).spec().unwrap();
        assert_eq!(spec.parameters[0].unit, resistance);
        assert_eq!(spec.states[0].unit, pressure);
    }
}

#[test]
fn a_network_that_stores_nothing_has_no_state_and_runs() {
    let setup = network(
        json!({ "elements": [flow_in("a"), { "name": "out", "kind": "R", "from": "a", "value": 2.0 }] }),
        &[],
    );
    let window = over(&setup, vec![0.5, 1.0], vec![signal(&[0.0, 1.0], |t| 10.0 * t)]);
    let prediction = setup.build().unwrap().run(&job(&window, &[])).unwrap();
    assert!(prediction.state.is_empty());
    assert_eq!(series(&setup, &prediction, "p_a"), [10.0, 20.0]);
}
