//! The programs of the examples, run with the templates and rules of their studies at the values that made their data.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;

use starlings_models::{
    Description, FilesDef, Job, ModelDef, Quantity, SOLVER, Setup, Signal, SolverDef, Spec, Window,
};
use starlings_solver::{SiteOptions, Solvers};

use super::map;

fn folder(example: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(example).canonicalize().unwrap()
}

fn template(example: &str, file: &str) -> BTreeMap<String, String> {
    let text = std::fs::read_to_string(folder(example).join(format!("{file}.tmpl"))).unwrap();
    map(&[(file, &text)])
}

/// One run.
fn run(
    command: &[&str],
    files: FilesDef,
    parameters: &[(&str, f64)],
    outputs: Vec<Quantity>,
    window: Window,
    inputs: &[&str],
) -> Vec<f64> {
    let names: Vec<String> = outputs.iter().map(|q| q.name.clone()).collect();
    let spec = Spec {
        kind: SOLVER.to_owned(),
        parameters: parameters.iter().map(|(name, _)| Quantity::new(name, "")).collect(),
        inputs: inputs.iter().map(|name| Quantity::new(name, "")).collect(),
        outputs,
        ..Spec::default()
    };
    let solver = SolverDef {
        adapter: "command".to_owned(),
        command: command.iter().map(|word| (*word).to_owned()).collect(),
        files: Some(files),
        timeout: 120.0,
        described: Some(Description { spec, deterministic: true, ..Description::default() }),
        ..SolverDef::default()
    };
    let setup = Setup {
        model: ModelDef { kind: SOLVER.to_owned(), solver: Some(Box::new(solver)), ..ModelDef::default() },
        parameters: parameters.iter().map(|(name, _)| (*name).to_owned()).collect(),
        outputs: names,
        ..Setup::default()
    };
    let forward = Solvers::new(SiteOptions::default()).build(&setup).unwrap();
    let theta = parameters.iter().map(|(_, value)| *value).collect();
    let job = Job { particle: 0, record: 0, window: Arc::new(window), theta, state: None };
    forward.run(&job).unwrap().outputs
}

#[test]
fn the_program_in_c_cools_a_plate_as_the_series_solution_does() {
    let built = tempfile::tempdir().unwrap();
    let program = built.path().join("solver").display().to_string();
    let source = folder("solver-c").join("solver.c");
    let mut cc = Command::new("cc");
    cc.args(["-O2", "-Wall", "-Werror", "-o", &program]).arg(source).arg("-lm");
    assert!(cc.status().unwrap().success());
    let files = FilesDef {
        templates: template("solver-c", "params.txt"),
        reads: map(&[("centre", "csv:result.csv:centre"), ("surface", "csv:result.csv:surface")]),
        ..FilesDef::default()
    };
    let times = vec![2.0, 30.25, 120.0];
    let window = Window::free(0.0, times, 2, Vec::new());
    let outputs = vec![Quantity::new("centre", "degC"), Quantity::new("surface", "degC")];
    let truth = [("k", 45.0), ("h", 1200.0), ("plate", 850.0)];
    let got = run(&[&program], files, &truth, outputs, window, &[]);
    // Carslaw and Jaeger's series; forty volumes are within 0.06 K of it.
    let series = [849.588_59, 738.522_97, 602.153_88, 475.825_36, 184.462_50, 148.772_54];
    for (got, series) in got.iter().zip(series) {
        assert!((got - series).abs() < 0.06, "{got} against {series}");
    }
}

#[test]
fn calculix_bends_the_beam_of_its_example() {
    if Command::new("ccx").arg("-v").stdout(Stdio::null()).status().is_err() {
        println!("skipped: CalculiX is not installed (package calculix-ccx)");
        return;
    }
    let mesh = folder("calculix").join("mesh.inp").display().to_string();
    let files = FilesDef {
        templates: template("calculix", "beam.inp"),
        copies: map(&[("mesh.inp", &mesh)]),
        reads: map(&[("deflection", "column:beam.dat:4")]),
    };
    let times = vec![1.0, 2.0];
    let force = Signal { times: times.clone(), values: vec![5.1, 9.8] };
    let window = Window::free(1.0, times, 3, vec![force]);
    let outputs = vec![Quantity::new("deflection", "mm").size(3)];
    let truth = [("E_root", 70.0), ("E_middle", 45.0), ("E_tip", 30.0)];
    let got = run(&["ccx", "beam"], files, &truth, outputs, window, &["force"]);
    // Of the example's data, printed with seven digits; a step converges to about 1e-5 of it.
    let known = [0.444_004_9, 1.747_022, 3.683_119, 0.853_228_6, 3.356_982, 7.076_723];
    for (got, known) in got.iter().zip(known) {
        assert!((got / known - 1.0).abs() < 1e-4, "{got} against {known}");
    }
}
