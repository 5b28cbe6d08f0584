//! `starlings identify` on the examples: what each of them can determine.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod identify_kit;

use common::{output, repository, starlings};
use identify_kit::{Case, numbers, parse, warns};
use serde_json::Value;

#[test]
fn stiffness_of_a_tube_and_of_the_tissue_around_it_are_known_as_one() {
    let example = repository("examples/fsi-tube");
    let study = std::fs::read_to_string(example.join("study.toml")).unwrap();
    let tissue = "[[parameters]]\nname = \"k_s\"\nprior = { transform = \"log2\", median = 2e5, sd = 1.0 }\n[[records]]";
    let mut study = study.replace("[[records]]", tissue);
    for file in ["initial.csv", "wall.csv", "flow.csv"] {
        study = study.replace(&format!("\"{file}"), &format!("\"{}", example.join(file).display()));
    }
    let found = Case::new(&study).json(&[]);
    let names: Vec<&str> =
        found["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["E1", "E2", "E3", "E4", "E5", "k_s"]);
    for ring in 0..5 {
        // The posterior of a run has about -0.99: the prior loosens a lock that is perfect in a wall of rings.
        assert!(found["correlation"][ring][5].as_f64().unwrap() < -0.99, "{}", found["correlation"]);
        assert!(found["posterior_correlation"][ring][5].as_f64().unwrap() < -0.99);
        assert!(warns(&found, &[names[ring], "and k_s are correlated (-1.000)"]), "{}", found["warnings"]);
    }
    assert!(found["advice"].as_str().unwrap().contains("; without "), "{}", found["advice"]);
    let weakest = &found["directions"][0];
    assert!(weakest["combination"].as_str().unwrap().starts_with("k_s − 0.2 E1 − 0.2 E2"), "{weakest}");
    assert!(weakest["share"].as_f64().unwrap() > 0.99 && weakest["standard_error"].is_null());
    assert!(warns(&found, &["combination k_s"]), "{}", found["warnings"]);
    assert!(found["advice"].as_str().unwrap().contains("tells them apart"), "{}", found["advice"]);
}

#[test]
fn the_weak_combinations_of_the_coarctation_are_named() {
    let study = repository("examples/coarctation/study.toml");
    let (code, stdout, stderr) = output(starlings().arg("identify").arg(study).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    let found = parse(&stdout);
    let parameters = found["parameters"].as_array().unwrap();
    let directions = found["directions"].as_array().unwrap();
    assert_eq!(directions.len(), parameters.len());
    let share = |d: &Value| d["share"].as_f64().unwrap();
    assert!(directions.windows(2).all(|pair| share(&pair[0]) >= share(&pair[1])), "the weakest first");
    // Weakest of all is what is forgotten first, the flow through the isthmus at the start; then the pressures at the start
    // together, which the distal resistances forget over a beat or two. None keeps more than a fifth of its prior.
    assert_eq!(directions[0]["combination"], "initial:stored_q_isthmus");
    assert!((0.15..0.22).contains(&share(&directions[0])), "{}", directions[0]);
    let weakest = &directions[1];
    let members: Vec<&str> =
        weakest["parameters"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let stored = ["lsa", "bca", "lcca", "asc", "dao"].map(|at| format!("initial:stored_p_{at}"));
    assert_eq!(members[..5], stored, "{weakest}");
    assert!((0.08..0.12).contains(&share(weakest)), "{weakest}");
    let words = weakest["combination"].as_str().unwrap();
    assert!(words.starts_with("initial:stored_p_lsa + 0.52 initial:stored_p_bca"), "{words}");
    assert!(found["advice"].as_str().unwrap().contains(words), "{}", found["advice"]);
    for p in parameters {
        assert!(p["standard_error"].as_f64().unwrap() > 0.0, "the data determine every parameter: {p}");
    }
}

#[test]
fn an_unknown_loss_is_locked_to_the_resistance_behind_it() {
    let study = repository("examples/coarctation/unknown-loss.toml");
    let (code, stdout, stderr) = output(starlings().arg("identify").arg(study).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    let found = parse(&stdout);
    let at = |name: &str| {
        let of_name = |p: &Value| p["name"] == name;
        found["parameters"].as_array().unwrap().iter().position(of_name).unwrap()
    };
    let (loss, behind) = (at("Kv_coarctation"), at("Rp_dao"));
    let correlation = found["correlation"][loss][behind].as_f64().unwrap();
    // In series, and nothing is measured between them: only their sum shows.
    assert!(correlation < -0.99, "{correlation}");
    assert!(warns(&found, &["Rp_dao and Kv_coarctation are correlated (-1.000)"]), "{}", found["warnings"]);
    let weakest = &found["directions"][0];
    assert_eq!(weakest["parameters"].as_array().unwrap()[..], ["Kv_coarctation", "Rp_dao"], "{weakest}");
    assert!(weakest["share"].as_f64().unwrap() > 0.99 && weakest["standard_error"].is_null(), "{weakest}");
    // No other pair is locked: the quadratic loss bends the pressure, which a resistance does not. Where one of the locked
    // two meets a third, there is no number.
    let pairs = found["correlation"].as_array().unwrap().iter().enumerate();
    let locked = pairs.flat_map(|(i, row)| row.as_array().unwrap().iter().take(i).filter_map(Value::as_f64));
    let locked = locked.filter(|c| c.abs() > 0.99);
    assert_eq!(locked.count(), 1);
}

#[test]
fn two_records_share_a_parameter_and_keep_their_own_initial_values() {
    let found = {
        let study = repository("examples/pig-aorta-joint/study.toml");
        let (code, stdout, stderr) = output(starlings().arg("identify").arg(study).arg("--json"));
        assert_eq!(code, 0, "{stderr}");
        parse(&stdout)
    };
    let records = found["records"].as_array().unwrap();
    assert!(records.len() > 1, "{records:?}");
    let steps: u64 = records.iter().map(|r| r["n"].as_u64().unwrap()).sum();
    assert_eq!(steps as usize, found["gsf"]["time"].as_array().unwrap().len());
    for (k, record) in records.iter().enumerate() {
        let name = format!("initial:p[{}]", record["record"].as_str().unwrap());
        let curve = numbers(&found["sensitivity"][&name]);
        let (first, n) = (record["first"].as_u64().unwrap() as usize, record["n"].as_u64().unwrap() as usize);
        assert!(curve[first] > 0.1, "{k}: a record answers to its own initial value");
        let elsewhere = curve[..first].iter().chain(&curve[first + n..]);
        assert!(elsewhere.copied().all(|v| v.abs() < 1e-12), "{k}: and to no other");
    }
    // A centre and a pair for each parameter of the study (R, C, Zc, initial:p), whatever the number of its entries.
    assert_eq!(found["runs"].as_u64().unwrap() as usize, 9 * records.len());
}

#[test]
fn the_observer_of_the_study_does_not_enter() {
    let study = std::fs::read_to_string(repository("examples/pig-aorta/study.toml")).unwrap();
    let study = study
        .replace("data/in-vivo-1.csv", repository("examples/pig-aorta/data/in-vivo-1.csv").to_str().unwrap());
    let free = Case::new(&study).json(&[]);
    let observed = Case::new(&format!("{study}\n[observer]\nkind = \"nudging\"\ngain = 5.0\n")).json(&[]);
    assert_eq!(free["gsf"], observed["gsf"]);
    assert!(observed["conditional_on"].as_str().unwrap().contains("observer is off"));
}
