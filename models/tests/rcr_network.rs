//! Linear networks against closed forms and other models; what a network says of itself.
#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod common;
mod rcr_network_kit;

use common::{job, run};
use rcr_network_kit::{beat, everything, flow_in, grid, network, over, series, signal, simulate};
use serde_json::json;
use starlings_models::{BuildSetup, ModelFailure, ParticleError, Setup};

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
fn an_element_faster_than_numbers_hold_is_an_error_and_not_an_endless_step() {
    for link in [1e-40, 1e-150] {
        let setup = network(
            json!({ "elements": [
                { "name": "one", "kind": "C", "from": "a", "value": 1.0, "initial": 50.0 },
                { "name": "link", "kind": "R", "from": "a", "to": "b", "value": link },
                { "name": "two", "kind": "C", "from": "b", "value": 1.0 },
                { "name": "out", "kind": "R", "from": "b", "value": 1.0 },
            ]}),
            &[],
        );
        let error = setup.build().unwrap().run(&job(&over(&setup, vec![0.5], vec![]), &[])).unwrap_err();
        assert!(matches!(&error, ParticleError::Model(ModelFailure::NotFinite { .. })), "{link}: {error}");
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
    assert_eq!(
        states,
        [
            "stored_p_lv",
            "stored_p_asc",
            "stored_q_blood",
            "stored_p_head",
            "stored_p_legs",
            "stored_v_coupling"
        ]
    );
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
