//! Every example whose model runs in a program of its own, run as a user would run it. Those that need more than a C compiler
//! are ignored unless asked for: `.ci/solvers` installs what they need.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod example_kit;

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use common::{repository, run};
use example_kit::{example_in, of_solvers};

/// A copy of an example: programs write beside their sources.
fn copied(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(repository("examples").join(name)).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() && path.extension().is_none_or(|kind| kind != "fmu") {
            std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    folder
}

fn example(name: &str) {
    example_in(copied(name).path());
}

/// Estimates and covariances of a posterior, in the order of the file.
fn numbers(out: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(out.join("posterior.csv")).unwrap();
    text.lines()
        .skip(1)
        .flat_map(|line| line.split(',').filter_map(|cell| cell.parse().ok()).collect::<Vec<f64>>())
        .collect()
}

#[test]
fn a_program_in_c_needs_a_compiler_and_no_library() {
    let folder = copied("solver-c");
    let compiled = Command::new("cc")
        .args(["-O2", "-o", "solver", "solver.c", "-lm"])
        .current_dir(folder.path())
        .status()
        .unwrap();
    assert!(compiled.success());
    example_in(folder.path());
}

#[test]
fn every_example_of_a_solver_is_tested() {
    let listed =
        ["solver-c", "solver-python", "artery-ring", "fsi-solver", "fmu", "mpi", "um-bridge", "calculix"];
    assert_eq!(BTreeSet::from(listed.map(str::to_owned)), of_solvers());
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn a_solver_in_python_gives_the_posterior_of_the_same_equations() {
    let folder = copied("solver-python");
    example_in(folder.path());
    let (own, native) = (folder.path().join("own"), folder.path().join("of-equations"));
    run(&folder.path().join("study.toml"), &own, 2);
    run(&folder.path().join("native.toml"), &native, 2);
    let (own, native) = (numbers(&own), numbers(&native));
    assert_eq!(own.len(), native.len());
    assert!(own.len() > 20, "{own:?}");
    for (a, b) in own.iter().zip(&native) {
        assert!((a - b).abs() <= 1e-10 * b.abs().max(1e-6), "{a} against {b}");
    }
}

#[test]
#[ignore = "needs scikit-fem: .ci/solvers"]
fn a_finite_element_code_finds_three_moduli_with_its_observer_inside() {
    example("artery-ring");
}

/// Young's moduli of a summary with their sd.
fn moduli(summary: &Value) -> Vec<(f64, f64)> {
    let of = |p: &Value| (p["estimate"].as_f64().unwrap(), p["sd"].as_f64().unwrap());
    let all = summary["parameters"].as_array().unwrap();
    all.iter().filter(|p| p["name"].as_str().unwrap().starts_with('E')).map(of).collect()
}

/// By how much the observer of a run makes its innovations larger: what it lets in of the noise.
fn let_in(summary: &Value) -> f64 {
    let rms = |key: &str| summary["observer"][key].as_f64().unwrap();
    rms("innovation_rms_with") - rms("innovation_rms_without")
}

#[test]
#[ignore = "needs scikit-fem: .ci/solvers"]
fn a_coupled_solver_finds_what_the_native_tube_finds_with_either_observer() {
    let folder = copied("fsi-solver");
    example_in(folder.path());
    let go = |name: &str, workers: usize| {
        let out = folder.path().join(format!("{name}-{workers}"));
        let summary = run(&folder.path().join(format!("{name}.toml")), &out, workers);
        (summary, std::fs::read(out.join("posterior.csv")).unwrap())
    };
    let mut two = Vec::new();
    for (solver, tube, most) in [("study", "tube", 0.1), ("velocities", "velocities-tube", 0.25)] {
        let ((solver, posterior), (tube, _)) = (go(solver, 2), go(tube, 2));
        let (own, native) = (moduli(&solver), moduli(&tube));
        assert!(own.len() == 5 && native.len() == 5);
        for ((a, sd), (b, _)) in own.iter().zip(&native) {
            println!("{a:.5e} against {b:.5e}: {:.3} sd", (a - b).abs() / sd);
            // Waves of ten centimetres and more in a vessel of one: two dimensions add a thousandth to the mass of the blood.
            assert!((a - b).abs() <= most * sd, "{a} against {b} ± {sd}");
        }
        let (own, native) = (let_in(&solver), let_in(&tube));
        println!("let in: {own:.3e} against {native:.3e}");
        // An observer that does nothing lets in nothing. Found: 3 and 28 % apart.
        assert!(native > 1e-4 && (own / native - 1.0).abs() < 0.4, "{own} against {native}");
        two = posterior;
    }
    // The last study, of the velocities.
    assert!(two == go("velocities", 1).1, "one worker gives the bytes of two");
}

#[test]
#[ignore = "needs fmpy and pythonfmu: .ci/solvers"]
fn a_functional_mock_up_unit_is_a_model() {
    let folder = copied("fmu");
    let built = Command::new("python3").arg("build.py").current_dir(folder.path()).status().unwrap();
    assert!(built.success());
    example_in(folder.path());
}

#[test]
#[ignore = "needs MPI: .ci/solvers"]
fn a_program_on_two_ranks_is_one_worker() {
    example("mpi");
}

#[test]
#[ignore = "needs umbridge: .ci/solvers"]
fn a_um_bridge_server_is_a_model() {
    example("um-bridge");
}

#[test]
#[ignore = "needs CalculiX: .ci/solvers"]
fn a_finite_element_program_without_a_line_of_code() {
    example("calculix");
}
