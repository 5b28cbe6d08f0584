//! What drives a network of svZeroDSolver: expressions, numbers, times that begin elsewhere, and flows through inertances.

use std::f64::consts::PI;
use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::{Table, at, import, predicted};
use crate::common::{refused, starlings};

/// Samples of a period.
const SAMPLES: usize = 100;

fn sampled(course: impl Fn(f64) -> f64, start: f64) -> (Vec<f64>, Vec<f64>) {
    let times: Vec<f64> = (0..=SAMPLES).map(|k| start + k as f64 / SAMPLES as f64).collect();
    let values = times.iter().map(|t| course(*t)).collect();
    (times, values)
}

/// A source, a vessel and a resistance of 10 in a row, the last of ten periods of one second.
fn network(source: &str, values: &Value, (kind, element): (&str, &Value)) -> Value {
    json!({
        "boundary_conditions": [
            {"bc_name": "IN", "bc_type": source, "bc_values": values},
            {"bc_name": "OUT", "bc_type": "RESISTANCE", "bc_values": {"R": 10.0, "Pd": 0.0}},
        ],
        "simulation_parameters": {"number_of_cardiac_cycles": 10, "number_of_time_pts_per_cardiac_cycle": SAMPLES + 1},
        "vessels": [{
            "vessel_id": 0, "vessel_name": "tube", "boundary_conditions": {"inlet": "IN", "outlet": "OUT"},
            "zero_d_element_type": kind, "zero_d_element_values": element,
        }],
    })
}

fn run(folder: &Path, name: &str, network: &Value) -> (Table, String) {
    let path = folder.join(format!("{name}.json"));
    std::fs::write(&path, network.to_string()).unwrap();
    let notes = import(&path, &folder.join(name))["notes"].to_string();
    (predicted(&folder.join(name)), notes)
}

/// Largest distance of a column from a course over the period.
fn off(found: &Table, column: &str, course: impl Fn(f64) -> f64) -> f64 {
    found["time"].iter().fold(0.0, |most: f64, t| most.max((at(found, column, *t) - course(*t)).abs()))
}

#[test]
fn an_expression_drives_a_network_as_its_samples_do() {
    let folder = TempDir::new().unwrap();
    let tube = json!({"R_poiseuille": 1.0, "C": 0.01});
    let tube = ("BloodVessel", &tube);
    let (text, flow) = ("3 + 2*cos(8*ATAN(1.)*t)", |t: f64| (2.0 * PI * t).cos().mul_add(2.0, 3.0));
    let (t, values) = sampled(flow, 0.0);
    let (sampled, _) = run(folder.path(), "sampled", &network("FLOW", &json!({"t": t, "Q": values}), tube));
    let (found, _) = run(folder.path(), "expression", &network("FLOW", &json!({"fn": text}), tube));
    // Lines between a hundred samples of a cosine are off by 5·10⁻⁴ of it.
    assert!(off(&found, "p_tube_out", |t| at(&sampled, "p_tube_out", t)) < 0.02);
    // The flow into R = 10 behind C = 0.01 to the ground, driven by a cosine: a low pass of 0.1 s.
    let angle = (0.2 * PI).atan();
    let wanted = |t: f64| 10.0 * (2.0 * angle.cos()).mul_add((2.0 * PI * t - angle).cos(), 3.0);
    assert!(off(&found, "p_tube_out", wanted) < 1e-3, "{}", off(&found, "p_tube_out", wanted));
    let path = folder.path().join("bad.json");
    for (values, words) in [
        (json!({"fn": "2*cos(t"}), "boundary_conditions[0].bc_values.fn: `2*cos(t`"),
        (json!({"fn": "heart(t)"}), "boundary_conditions[0].bc_values.fn"),
        (json!({"fn": "sin(t)"}), "does not repeat after the period of 1"),
        (json!({"fn": "1", "Q": [1.0]}), "stands in place of `Q` and `t`"),
        (json!({"t": [0.0]}), "missing field `Q`"),
        (json!({"Q": "high"}), "expected a number or a list of numbers"),
    ] {
        std::fs::write(&path, network("FLOW", &values, tube).to_string()).unwrap();
        let out = folder.path().join("bad");
        refused(starlings().arg("import").arg(&path).arg("--out").arg(&out), &[words]);
        assert!(!out.exists());
    }
}

#[test]
fn a_flow_through_an_inertance_meets_the_pressure_of_its_rate() {
    let folder = TempDir::new().unwrap();
    let (t, values) = sampled(|t| (2.0 * PI * t).sin(), 0.0);
    let element = json!({"R_poiseuille": 1.0, "L": 4.0});
    let tube = ("BloodVessel", &element);
    let (found, notes) = run(folder.path(), "inlet", &network("FLOW", &json!({"t": t, "Q": values}), tube));
    // Central differences of a hundred samples are short of a cosine by (2π/100)²/6 of it.
    let wanted = |t: f64| 11.0f64.mul_add((2.0 * PI * t).sin(), 8.0 * PI * (2.0 * PI * t).cos());
    let most = off(&found, "p_tube_in", wanted);
    assert!(most < 1e-3 * 8.0 * PI, "{most}");
    assert!(notes.contains("prescribes the flow through the inertance `tube_blood`"), "{notes}");
    // The same at an outlet, where what leaves is what the source takes.
    let mut other = network("PRESSURE", &json!({"P": 5.0}), tube);
    other["boundary_conditions"][1] =
        json!({"bc_name": "OUT", "bc_type": "FLOW", "bc_values": {"t": t, "Q": values}});
    let (found, _) = run(folder.path(), "outlet", &other);
    let wanted = |t: f64| 5.0 - (2.0 * PI * t).sin() - 8.0 * PI * (2.0 * PI * t).cos();
    let most = off(&found, "p_tube_out", wanted);
    assert!(most < 1e-3 * 8.0 * PI, "{most}");
}

#[test]
fn times_that_begin_late_and_vessels_of_one_element_are_read() {
    let folder = TempDir::new().unwrap();
    let flow = |t: f64| 2.0 + (2.0 * PI * t).sin();
    let (t, values) = sampled(flow, 0.04);
    let element = json!({"R": 5.0});
    let tube = ("Resistance", &element);
    let (found, _) = run(folder.path(), "late", &network("FLOW", &json!({"t": t, "Q": values}), tube));
    // Before the first sample lies the line through the first two, off by 0.04 · 0.05/2 of the second derivative.
    assert!(off(&found, "p_tube_in", |t| 15.0 * flow(t)) < 0.3);
    let element = json!({"C": 0.02});
    let tube = ("Capacitance", &element);
    let (found, _) = run(folder.path(), "store", &network("FLOW", &json!({"Q": 3.0}), tube));
    assert!(off(&found, "p_tube_in", |_| 30.0) < 1e-6);
    let element = json!({"L": 0.02});
    let tube = ("Inductance", &element);
    let (found, _) = run(folder.path(), "mass", &network("PRESSURE", &json!({"P": [7.0], "t": [0.0]}), tube));
    assert!(off(&found, "q_OUT", |_| 0.7) < 1e-6);
}
