//! Chambers, valves, losses without resistance and large networks, against closed forms.
#![allow(clippy::unwrap_used)]

mod common;
mod rcr_network_kit;

use common::{run, run_in_pieces};
use rcr_network_kit::{grid, network, over, signal, simulate};
use serde_json::{Value, json};
use starlings_models::BuildSetup;

#[test]
fn an_inertance_behind_a_loss_without_resistance_speeds_up_as_a_hyperbolic_tangent() {
    // L dq/dt = P − K q² from rest: q = √(P/K) tanh(t √(P K)/L).
    let (p, k, l) = (100.0_f64, 4e-3_f64, 0.05);
    for (tolerance, most) in [(1e-4, 1e-3), (1e-6, 1e-5), (1e-10, 1e-8)] {
        let layout = json!({ "tolerance": tolerance, "elements": [
            { "name": "heart", "kind": "pressure", "to": "a", "value": p },
            { "name": "blood", "kind": "L", "from": "a", "to": "b", "value": l },
            { "name": "stenosis", "kind": "loss", "from": "b", "linear": 0.0, "quadratic": k },
        ]});
        let times = grid(10, 0.3);
        let got = simulate(&network(layout, &[]), &times, vec![]);
        for (t, q) in times.iter().zip(&got["q_stenosis"]) {
            let want = (p / k).sqrt() * (t * (p * k).sqrt() / l).tanh();
            // Ten times the tolerance on flows of up to 160; of the last what the resistance of 1e-8 takes that stands for none.
            assert!((q - want).abs() <= most * 160.0, "{tolerance} at {t}: {q} against {want}");
        }
    }
}

#[test]
fn a_loss_without_any_part_passes_every_flow_without_a_drop() {
    let layout = json!({ "elements": [
        { "name": "heart", "kind": "pressure", "to": "a", "value": 90.0 },
        { "name": "open", "kind": "loss", "from": "a", "to": "b", "linear": 0.0, "quadratic": 0.0 },
        { "name": "wall", "kind": "C", "from": "b", "value": 0.5, "initial": 0.0 },
        { "name": "body", "kind": "R", "from": "b", "value": 1.5 },
    ]});
    let got = simulate(&network(layout, &[]), &[1.0], vec![]);
    // A part of 1e-8 of the smallest resistance stands in its place.
    assert!((got["q_body"][0] - 60.0).abs() < 1e-5, "{:?}", got["q_body"]);
    assert!(got["dp_open"][0].abs() < 1e-5, "{:?}", got["dp_open"]);
}

#[test]
fn a_resistance_of_zero_joins_its_nodes_in_a_linear_network_and_under_an_open_valve() {
    // A Windkessel of two elements: p of the node is that of the chamber, with or without a resistance written before it.
    let inflow = |times: &[f64]| vec![signal(times, |t| 80.0 + 40.0 * (6.0 * t).sin())];
    let times = grid(40, 2.0);
    let outlet = |proximal: f64| {
        json!({ "elements": [
            { "name": "inflow", "kind": "flow", "to": "a" },
            { "name": "body", "kind": "rcr", "from": "a", "proximal": proximal, "compliance": 1.2, "distal": 1.1, "initial": 70.0 },
        ]})
    };
    let joined = simulate(&network(outlet(0.0), &[]), &times, inflow(&times));
    let apart = simulate(&network(outlet(0.05), &[]), &times, inflow(&times));
    for (k, t) in times.iter().enumerate() {
        let flow = 80.0 + 40.0 * (6.0 * t).sin();
        // What flows is given: the chamber does not feel R_p, which stands as 1e-8 of R_d.
        let wanted = apart["p_a"][k] - 0.05 * flow;
        assert!((joined["p_a"][k] - wanted).abs() < 1e-4, "{t}: {} for {wanted}", joined["p_a"][k]);
    }
    assert!((apart["p_a"][0] - joined["p_a"][0]).abs() > 3.0, "the resistance is felt where it is");
    // Two stores joined without a resistance are one: C = 0.7 under 60 mL/s.
    let stores = json!({ "elements": [
        { "name": "inflow", "kind": "flow", "to": "a" },
        { "name": "near", "kind": "C", "from": "a", "value": 0.5, "initial": 50.0 },
        { "name": "link", "kind": "R", "from": "a", "to": "b", "value": 0.0 },
        { "name": "far", "kind": "C", "from": "b", "value": 0.2, "initial": 50.0 },
    ]});
    let got = simulate(&network(stores, &[]), &[0.5], vec![signal(&[0.0, 1.0], |_| 60.0)]);
    assert!((got["p_a"][0] - (50.0 + 30.0 / 0.7)).abs() < 1e-5, "{:?}", got["p_a"]);
    assert!((got["p_b"][0] - got["p_a"][0]).abs() < 1e-5, "{:?}", got["p_b"]);
    let valve = json!({ "elements": [
        { "name": "heart", "kind": "pressure", "to": "a", "value": 90.0 },
        { "name": "valve", "kind": "diode", "from": "a", "to": "b", "open": 0.0, "closed": 1e4 },
        { "name": "body", "kind": "R", "from": "b", "value": 1.5 },
    ]});
    let got = simulate(&network(valve, &[]), &[1.0], vec![]);
    assert!((got["q_body"][0] - 60.0).abs() < 1e-5, "{:?}", got["q_body"]);
}

/// A chamber that empties through a resistance.
fn emptying(extra: &Value) -> Value {
    let mut chamber = json!({ "name": "heart", "kind": "chamber", "from": "a", "active": 3.0, "passive": 0.5,
        "rest": 10.0, "initial": 60.0 });
    for (key, value) in extra.as_object().unwrap() {
        chamber[key] = value.clone();
    }
    json!({ "tolerance": 1e-9, "elements": [chamber, { "name": "out", "kind": "R", "from": "a", "value": 2.0 }] })
}

#[test]
fn a_chamber_empties_as_its_elastance_rises() {
    // dV/dt = −E (V − V₀)/R with E = 0.5 + 2.5 t.
    let times = grid(8, 1.0);
    let got = simulate(&network(emptying(&json!({})), &[]), &times, vec![signal(&[0.0, 1.0], |t| t)]);
    for (i, t) in times.iter().enumerate() {
        let stretch = 50.0 * (-(0.5 * t + 1.25 * t * t) / 2.0).exp();
        let pressure = (0.5 + 2.5 * t) * stretch;
        // The tolerance of 1e-9 on volumes of 60.
        assert!((got["V_heart"][i] - 10.0 - stretch).abs() < 6e-7, "{t}: {}", got["V_heart"][i]);
        assert!((got["p_a"][i] - pressure).abs() < 2e-6, "{t}: {}", got["p_a"][i]);
        assert!((got["q_out"][i] + got["q_heart"][i]).abs() < 1e-9, "what leaves the chamber goes out");
    }
}

#[test]
fn a_passive_wall_that_stiffens_empties_as_its_logarithm() {
    // With a = 0 and E = 0: R dV/dt = −K (e^{k s} − 1) for s = V − V₀, so that 1 − e^{−k s} shrinks as e^{−K k t/R}.
    let (scale, rate, r) = (9.0, 0.02, 2.0);
    let layout = emptying(&json!({ "passive": 0.0, "wall": scale, "stiffening": rate }));
    let times = grid(8, 4.0);
    let got = simulate(&network(layout, &[]), &times, vec![signal(&[0.0, 4.0], |_| 0.0)]);
    for (i, t) in times.iter().enumerate() {
        let left = (1.0 - (-rate * 50.0_f64).exp()) * (-scale * rate * t / r).exp();
        let want = 10.0 - (1.0 - left).ln() / rate;
        assert!((got["V_heart"][i] - want).abs() < 6e-7, "{t}: {} against {want}", got["V_heart"][i]);
    }
}

#[test]
fn a_compliance_under_a_chamber_is_pressed_by_its_share() {
    // The chamber is closed: p = 30 a. Behind it R C dp/dt + p = R C s dp_chamber/dt.
    let (c, r, share) = (0.2, 1.5, 0.4);
    let layout = json!({ "tolerance": 1e-9, "elements": [
        { "name": "heart", "kind": "chamber", "from": "lv", "active": 0.6, "rest": 10.0, "initial": 60.0 },
        { "name": "muscle", "kind": "C", "from": "m", "value": c, "around": "lv", "share": share },
        { "name": "vein", "kind": "R", "from": "m", "value": r },
    ]});
    let times = grid(8, 1.0);
    let got = simulate(&network(layout, &[]), &times, vec![signal(&[0.0, 1.0], |t| t)]);
    for (i, t) in times.iter().enumerate() {
        let want = r * c * share * 30.0 * (1.0 - (-t / (r * c)).exp());
        assert!((got["p_m"][i] - want).abs() < 1e-7, "{t}: {} against {want}", got["p_m"][i]);
        assert!((got["q_muscle"][i] + want / r).abs() < 1e-7, "{t}: {}", got["q_muscle"][i]);
        assert!((got["p_lv"][i] - 30.0 * t).abs() < 1e-9);
    }
}

#[test]
fn a_valve_with_a_steepness_has_the_resistance_of_its_drop() {
    let (open, closed, steepness, load) = (0.05_f64, 50.0_f64, 2.0, 1.0);
    for drive in [-40.0, -0.3, 0.3, 40.0] {
        let layout = json!({ "elements": [
            { "name": "heart", "kind": "pressure", "to": "a", "value": drive },
            { "name": "valve", "kind": "diode", "from": "a", "to": "b", "open": open, "closed": closed,
              "steepness": steepness },
            { "name": "body", "kind": "R", "from": "b", "value": load },
        ]});
        let got = simulate(&network(layout, &[]), &[0.0], vec![]);
        let (drop, flow) = (got["dp_valve"][0], got["q_valve"][0]);
        let resistance = open + (closed - open) * 0.5 * (1.0 - (steepness * drop).tanh());
        // Rounding of pressures of 40.
        assert!((drop - resistance * flow).abs() < 1e-12, "{drive}: {drop} over {flow}");
        assert!((flow * load + drop - drive).abs() < 1e-12);
    }
}

/// A chain of so many vessels, each a loss, a compliance and an inertance.
fn chain(n: usize) -> Value {
    let mut elements = vec![json!({ "name": "inflow", "kind": "flow", "to": "n0" })];
    for i in 0..n {
        let [from, mid, to] = [format!("n{i}"), format!("m{i}"), format!("n{}", i + 1)];
        elements.push(
            json!({ "name": format!("loss{i}"), "kind": "loss", "from": from, "to": mid, "linear": 0.01,
            "quadratic": 1e-5 }),
        );
        elements.push(
            json!({ "name": format!("wall{i}"), "kind": "C", "from": mid, "value": 1e-3, "initial": 0.0 }),
        );
        elements
            .push(json!({ "name": format!("blood{i}"), "kind": "L", "from": mid, "to": to, "value": 1e-3 }));
    }
    let end = format!("n{n}");
    elements.push(json!({ "name": "body", "kind": "rcr", "from": end, "proximal": 0.1, "compliance": 0.3,
        "distal": 1.0, "initial": 0.0 }));
    json!({ "elements": elements })
}

#[test]
fn a_chain_of_two_hundred_vessels_comes_to_the_pressure_that_its_losses_need() {
    let got = simulate(&network(chain(200), &[]), &[12.0], vec![signal(&[0.0, 12.0], |_| 60.0)]);
    // At rest every vessel drops 0.01 · 60 + 1e-5 · 3600; forty time constants of the body are left.
    let want = 200.0 * (0.6 + 0.036) + 66.0;
    assert!((got["p_n0"][0] - want).abs() < 1e-4 * want, "{:?} against {want}", got["p_n0"]);
    assert!((got["q_body"][0] - 60.0).abs() < 1e-3, "{:?}", got["q_body"]);
}

#[test]
fn a_chamber_with_valves_run_in_pieces_gives_the_bits_of_one_run() {
    let layout = json!({ "elements": [
        { "name": "veins", "kind": "pressure", "to": "v", "value": 8.0 },
        { "name": "mitral", "kind": "diode", "from": "v", "to": "lv", "open": 0.01, "closed": 1e4, "steepness": 5.0 },
        { "name": "heart", "kind": "chamber", "from": "lv", "active": 2.5, "passive": 0.08, "rest": 10.0, "initial": 100.0 },
        { "name": "aortic", "kind": "diode", "from": "lv", "to": "ao", "open": 0.01, "closed": 1e4, "smooth": 0.1 },
        { "name": "body", "kind": "rcr", "from": "ao", "proximal": 0.05, "compliance": 1.2, "distal": 1.0 },
    ]});
    let setup = network(layout, &[]);
    let pulse = signal(&grid(200, 1.6), |t| (std::f64::consts::PI * t / 0.4).sin().max(0.0));
    let window = over(&setup, grid(40, 1.6)[1..].to_vec(), vec![pulse]);
    let model = setup.build().unwrap();
    let whole = run(&*model, &window, &[]);
    for every in [1, 7] {
        assert_eq!(run_in_pieces(&*model, &window, &[], every), whole);
    }
    let aorta = rcr_network_kit::series(&setup, &whole, "p_ao");
    assert!(aorta.iter().any(|p| *p > 90.0), "it beats: {aorta:?}");
}

#[test]
fn valves_that_hardly_leak_open_from_rest() {
    // An ideal valve and an inertance between a chamber of 40 and an empty vessel: L dq/dt + R q = E (V₀ − Q) − Q/C for the volume Q
    // that went over, a damped oscillation until its flow would turn, when the valve shuts and the vessel keeps what it has.
    let (l, r, e, c) = (1e-3_f64, 0.05_f64, 0.5_f64, 1.0_f64);
    let layout = json!({ "elements": [
        { "name": "heart", "kind": "chamber", "from": "lv", "active": e, "initial": 80.0 },
        { "name": "aortic", "kind": "diode", "from": "lv", "to": "mid", "open": r, "closed": 1e7 * r, "smooth": 1e-6 },
        { "name": "blood", "kind": "L", "from": "mid", "to": "ao", "value": l },
        { "name": "wall", "kind": "C", "from": "ao", "value": c, "initial": 0.0 },
    ]});
    let times = grid(200, 0.4);
    let got = simulate(&network(layout, &[]), &times, vec![signal(&[0.0, 0.4], |_| 1.0)]);
    let (decay, stiffness) = (r / (2.0 * l), (e + 1.0 / c) / l);
    let ring = (stiffness - decay * decay).sqrt();
    let end = std::f64::consts::PI / ring;
    let rest = e * 80.0 / (e + 1.0 / c);
    for (t, p) in times.iter().zip(&got["p_ao"]) {
        let t = t.min(end);
        let over = rest * (1.0 - (-decay * t).exp() * ((ring * t).cos() + decay / ring * (ring * t).sin()));
        // The drop of 1e-6 over which the valve opens, its leak of 1e-5 per s, the tolerance of 1e-6 and the kink where it shuts.
        assert!((p - over / c).abs() < 2e-3, "{t}: {p} against {over}");
    }
}
