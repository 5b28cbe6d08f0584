//! `starlings import`: networks of svZeroDSolver and openBF, against what those programs computed.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::{Path, PathBuf};

use common::{output, refused, repository, starlings};
use serde_json::{Value, json};
use tempfile::TempDir;

#[path = "import_command/arteries.rs"]
mod arteries;
#[path = "import_command/hearts.rs"]
mod hearts;
#[path = "import_command/loop_scheme.rs"]
mod loop_scheme;
#[path = "import_command/signals.rs"]
mod signals;
#[path = "import_command/table.rs"]
mod table;

use table::{Table, at, table};

fn file(path: &str) -> PathBuf {
    repository("tests/import_files").join(path)
}

fn import(file: &Path, out: &Path) -> Value {
    let (code, stdout, stderr) =
        output(starlings().arg("import").arg(file).arg("--out").arg(out).arg("--json"));
    assert_eq!(code, 0, "{}: {stderr}", file.display());
    serde_json::from_str(&stdout).unwrap()
}

/// What the model of an imported study predicts; `check` accepts the study.
fn predicted(folder: &Path) -> Table {
    let study = folder.join("study.toml");
    let (code, _, stderr) = output(starlings().arg("check").arg(&study));
    assert_eq!(code, 0, "{stderr}");
    let (code, stdout, stderr) = output(starlings().arg("simulate").arg(&study));
    assert_eq!(code, 0, "{stderr}");
    table(&stdout)
}

/// Largest difference relative to the largest value.
fn difference(found: &Table, name: &str, times: &[f64], wanted: &[f64]) -> f64 {
    let size = wanted.iter().fold(0.0, |size: f64, v| size.max(v.abs()));
    let most =
        times.iter().zip(wanted).fold(0.0, |most: f64, (t, w)| most.max((at(found, name, *t) - w).abs()));
    most / size
}

/// Results of svZeroDSolver for a vessel: times and a column.
fn results(name: &str, vessel: &str, column: &str) -> (Vec<f64>, Vec<f64>) {
    let text = std::fs::read_to_string(file(&format!("svzerodsolver/results/{name}.json"))).unwrap();
    let all: Value = serde_json::from_str(&text).unwrap();
    let rows = all["name"].as_object().unwrap().iter().filter(|(_, name)| *name == vessel);
    let value = |column: &str, row: &str| all[column][row].as_f64().unwrap();
    rows.map(|(row, _)| (value("time", row), value(column, row))).unzip()
}

/// Imports a file of svZeroDSolver and compares, relative to the largest value of a waveform: vessel, column of the results, output of the study.
fn compare(name: &str, bound: f64, waveforms: &[(&str, &str, &str)]) {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join(name);
    import(&file(&format!("svzerodsolver/{name}.json")), &out);
    let found = predicted(&out);
    for (vessel, column, predicted) in waveforms {
        let (times, wanted) = results(name, vessel, column);
        let most = difference(&found, predicted, &times, &wanted);
        assert!(most <= bound, "{name}: {column} of {vessel} is off by {most}");
    }
}

/// svZeroDSolver stops its iterations at this, and prints ten decimals.
const STEADY: f64 = 2e-10;
const VESSEL: &str = "branch0_seg0";
const PRESSURES: [(&str, &str, &str); 2] =
    [(VESSEL, "pressure_in", "p_branch0_seg0_in"), (VESSEL, "pressure_out", "p_branch0_seg0_out")];

/// Both pressures, and the flows through two elements.
fn all(flow_in: &'static str, flow_out: &'static str) -> Vec<(&'static str, &'static str, &'static str)> {
    let flows = [(VESSEL, "flow_in", flow_in), (VESSEL, "flow_out", flow_out)];
    PRESSURES.into_iter().chain(flows).collect()
}

#[test]
fn steady_vessels_are_those_of_svzerodsolver() {
    compare("steadyFlow_R_R", STEADY, &all("q_branch0_seg0", "q_OUT"));
    compare("steadyFlow_RC_R", STEADY, &all("q_branch0_seg0", "q_OUT"));
    compare("steadyFlow_RL_R", STEADY, &all("q_branch0_seg0", "q_branch0_seg0_blood"));
    compare("steadyFlow_RLC_R", STEADY, &all("q_branch0_seg0", "q_branch0_seg0_blood"));
    compare("steadyFlow_R_RCR", STEADY, &all("q_branch0_seg0", "q_OUT"));
    compare("steadyFlow_R_coronary", STEADY, &all("q_branch0_seg0", "q_OUT_Ra1"));
    compare("steadyFlow_stenosis_R", STEADY, &all("q_branch0_seg0", "q_OUT"));
    let fork = [
        ("branch0_seg0", "pressure_in", "p_branch0_seg0_in"),
        ("branch0_seg0", "pressure_out", "p_J0"),
        ("branch1_seg0", "pressure_out", "p_branch1_seg0_out"),
        ("branch1_seg0", "flow_in", "q_branch1_seg0"),
        ("branch2_seg0", "pressure_out", "p_branch2_seg0_out"),
        ("branch2_seg0", "flow_out", "q_OUT2"),
    ];
    compare("steadyFlow_bifurcationR_R1", STEADY, &fork);
}

#[test]
fn pulsatile_waveforms_are_those_of_svzerodsolver() {
    compare("pulsatileFlow_R_RCR", 2e-5, &all("q_branch0_seg0", "q_OUT"));
    compare("pulsatileFlow_R_coronary", 7e-5, &all("q_branch0_seg0", "q_OUT_Ra1"));
    // The source behind the vessel counts its flow towards it.
    compare("pulsatileFlow_CStenosis_steadyPressure", 5e-4, &PRESSURES);
    compare("pulsatileFlow_CStenosis_steadyPressure", 5e-4, &[(VESSEL, "flow_in", "q_branch0_seg0")]);
}

#[test]
fn blocks_keys_and_values_that_are_not_understood_are_named() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let refuse = |path: &Path, words: &[&str]| {
        refused(starlings().arg("import").arg(path).arg("--out").arg(&out), words);
        assert!(!out.exists(), "nothing is left of {}", path.display());
    };
    let good: Value = serde_json::from_str(
        &std::fs::read_to_string(file("svzerodsolver/steadyFlow_bifurcationR_R1.json")).unwrap(),
    )
    .unwrap();
    let cases = [
        ("/boundary_conditions/1/bc_type", json!("Impedance"), "`OUT1` of type `Impedance`"),
        ("/boundary_conditions/1/bc_values/R", json!([1.0, 2.0]), "boundary_conditions[1].bc_values.R"),
        ("/boundary_conditions/1/bc_values/R", json!(-1.0), "-1 is not above zero"),
        ("/boundary_conditions/1/bc_values/Q", json!(1.0), "unknown field `Q`"),
        (
            "/boundary_conditions/1/bc_name",
            json!("OUT9"),
            "boundary_conditions.outlet: no boundary condition is called `OUT1`; did you mean `OUT9`?",
        ),
        (
            "/vessels/1/zero_d_element_values/stenosis_coefficient",
            json!(-10.0),
            "changed.json: vessels[1].zero_d_element_values: the stenosis",
        ),
        ("/boundary_conditions/0/bc_values/t", json!([0.0, 0.0]), "time 0 is not later"),
        ("/boundary_conditions/0/bc_values/t", json!([0.0]), "1 times and 2 values"),
        ("/vessels/0/zero_d_element_type", json!("Chamber"), "a vessel of type `Chamber`"),
        ("/vessels/0/zero_d_element_values/K", json!(1.0), "vessels[0].zero_d_element_values"),
        ("/vessels/1/vessel_name", json!("branch0_seg0"), "two vessels are called"),
        ("/vessels/1/boundary_conditions/outlet", json!("OUT2"), "at two places"),
        ("/junctions/0/junction_type", json!("pump"), "a junction of type `pump`"),
        ("/junctions/0/outlet_vessels", json!([1]), "nothing is joined to the inlet of `branch2_seg0`"),
        ("/junctions/0/outlet_vessels", json!([1, 7]), "no vessel has the id 7"),
        ("/simulation_parameters/speed", json!(1), "simulation_parameters.speed: unknown field"),
        ("/simulation_parameters/coupled_simulation", json!(true), "coupled_simulation"),
        ("/calibration_parameters", json!({}), "`calibration_parameters`: is an input of svZeroDCalibrator"),
        ("/geometry", json!({}), "unknown field `geometry`"),
    ];
    let path = folder.path().join("changed.json");
    for (place, value, words) in cases {
        let mut changed = good.clone();
        let (parent, key) = place.rsplit_once('/').unwrap();
        changed.pointer_mut(parent).unwrap()[key] = value;
        std::fs::write(&path, changed.to_string()).unwrap();
        refuse(&path, &[words]);
    }
    for (text, words) in [("{", "is no JSON"), ("[]", "which is a JSON object"), ("{}", "neither `vessels`")]
    {
        std::fs::write(&path, text).unwrap();
        refuse(&path, &[words]);
    }
    refuse(&folder.path().join("none.json"), &["cannot be read"]);
    let other = folder.path().join("network.xml");
    std::fs::write(&other, "<network/>").unwrap();
    refuse(&other, &["a JSON of svZeroDSolver", "a YAML of openBF"]);
    std::fs::create_dir(&out).unwrap();
    let path = file("svzerodsolver/steadyFlow_R_R.json");
    refused(starlings().arg("import").arg(path).arg("--out").arg(&out), &["is there already", "--out"]);
}

/// A vessel with the label of another.
const TWICE: &str = "network:\n  - {label: upper_thoracic_aorta, sn: 2, tn: 8, L: 0.1, E: 400.0e3, R0: 9.0e-3, gamma_profile: 9}";

/// A vessel apart from the others.
const SECOND_INLET: &str = "network:\n  - {label: other, sn: 7, tn: 8, L: 0.1, E: 400.0e3, R0: 9.0e-3, h0: 0.8e-3, gamma_profile: 9}";

#[test]
fn an_aorta_of_openbf_runs_and_what_the_model_lacks_is_named() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("uta");
    import(&file("openbf/uta.yaml"), &out);
    let found = predicted(&out);
    assert_eq!(found["time"].len(), 100);
    let text = std::fs::read_to_string(file("openbf/uta.yaml")).unwrap();
    let path = folder.path().join("uta.yaml");
    std::fs::copy(file("openbf/uta_inlet.dat"), folder.path().join("uta_inlet.dat")).unwrap();
    let other = folder.path().join("other");
    let cases = [
        ("R1: 1.1752e7", "Rt: 0.5", "a reflection coefficient (`Rt`)"),
        ("R2: 1.1167e8", "visco-elastic: true", "`visco-elastic`"),
        ("R2: 1.1167e8", "M: 5", "less than the impedance of its end, and there is no R2"),
        ("project_name:", "project name:", "is of an openBF before version 1: write `project_name`"),
        ("R2: 1.1167e8", "R2: 1.1167e8\n    Pout: .nan", "Pout is NaN"),
        ("inlet_impedance_matching: false", "inlet_impedance_matching: true", "`inlet_impedance_matching`"),
        ("gamma_profile: 9", "gamma profile: 9", "write `gamma_profile`"),
        ("gamma_profile: 9", "colour: red", "unknown field `colour`"),
        ("E: 400.0e3", "E: -1.0", "E is -1"),
        ("E: 400.0e3", "E: stiff", "uta.yaml: line 17, column 8: `E`: invalid floating point"),
        ("    E: 400.0e3", "\tE: 400.0e3", "line 17: a tab stands before `E`: YAML takes blanks alone there"),
        ("    Cc: 1.0163e-8\n", "", "it has R1 and R2 and not Cc"),
        ("network:", TWICE, "network[1]: the label `upper_thoracic_aorta` is that of network[0] as well"),
        ("tn: 2", "tn: 1", "none where the flow enters"),
        ("network:", SECOND_INLET, "nodes 1 and 7 are only starts of vessels: the file names one inflow"),
        ("uta_inlet.dat", "none.dat", "none.dat cannot be read"),
    ];
    for (from, to, words) in cases {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        refused(starlings().arg("import").arg(&path).arg("--out").arg(&other), &[words]);
        assert!(!other.exists());
    }
}

#[test]
fn vessels_that_are_nothing_but_a_joint_are_told_with_the_outputs_that_there_are_not() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(file("svzerodsolver/steadyFlow_bifurcationR_R1.json")).unwrap();
    let mut network: Value = serde_json::from_str(&text).unwrap();
    network["vessels"][1]["zero_d_element_values"] = json!({ "R_poiseuille": 0.0 });
    let path = folder.path().join("joint.json");
    std::fs::write(&path, network.to_string()).unwrap();
    let notes = import(&path, &folder.path().join("joint"))["notes"].to_string();
    let told = "`branch1_seg0` has neither a resistance nor an inertance: its two ends are one node, and the study has no `q_branch1_seg0`, \
                `p_J0`";
    assert!(notes.contains(told), "{notes}");
}

#[test]
fn periods_that_the_program_would_add_are_told() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(file("svzerodsolver/pulsatileFlow_R_RCR.json")).unwrap();
    let mut network: Value = serde_json::from_str(&text).unwrap();
    let notes = |network: &Value, name: &str| {
        let path = folder.path().join(format!("{name}.json"));
        std::fs::write(&path, network.to_string()).unwrap();
        import(&path, &folder.path().join(name))["notes"].to_string()
    };
    assert!(!notes(&network, "as-given").contains("more periods"));
    network["simulation_parameters"]["use_cycle_to_cycle_error"] = json!(true);
    assert!(notes(&network, "until-they-repeat").contains("more periods than the"));
}
