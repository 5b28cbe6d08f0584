//! `starlings replay`: runs made again have the bits that they had, and what differs is told.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

#[allow(dead_code)] // other tests use the rest
mod bad_solver_kit;
mod common;

use std::path::{Path, PathBuf};

use bad_solver_kit::BadSolverStudy;
use common::{output, starlings};
use rusqlite::Connection;
use serde_json::Value;

/// A finished run of an example.
fn run(folder: &Path, name: &str) -> PathBuf {
    let out = folder.join(name);
    let study = common::repository(&format!("examples/{name}/study.toml"));
    common::run(&study, &out, 1);
    out
}

/// What `replay` says of a run of a folder, and its exit code.
fn replayed(folder: &Path, more: &[&str]) -> (i32, Value) {
    let (code, stdout, stderr) =
        output(starlings().arg("replay").arg(folder).args(more).args(["--workers", "1", "--json"]));
    (code, serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")))
}

#[test]
fn runs_made_again_have_the_bits_that_they_had_whether_their_inputs_are_stored_or_rebuilt() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = run(folder.path(), "rcr");
    let (code, found) = replayed(&out, &["3"]);
    assert_eq!((code, &found["agrees"], &found["n_run"]), (0, &true.into(), &1.into()), "{found}");
    assert_eq!(found["from"], found["analysis"], "by default a run whose inputs are stored");
    assert_eq!(found["runs"][0]["agreement"], "same_bits");
    let (code, found) = replayed(&out, &["0", "--pass", "2", "--analysis", "101"]);
    let from = found["from"].as_u64().expect("a number");
    assert!(code == 0 && from < 101, "{found}");
    // Five particles of every analysis in between, and the run itself.
    assert_eq!(found["n_run"].as_u64(), Some(5 * (101 - from) + 1));
    assert_eq!(found["runs"][0]["agreement"], "same_bits");
    let refused: [(&[&str], &str); 4] = [
        (&["5"], "there is no particle 5: the particles of this run are 0 to 4"),
        (&["1", "--pass", "9"], "was not run at pass 9: this run has passes 1 to "),
        (&["1", "--pass", "1", "--analysis", "90000"], "and analyses 0 to 800 in pass 1"),
        (&["1", "--study", "nowhere.toml"], "say where it and its recordings are with --study FILE"),
    ];
    for (arguments, expected) in refused {
        let (code, stdout, stderr) = output(starlings().arg("replay").arg(&out).args(arguments));
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
    let (code, _, stderr) = output(starlings().args(["replay", "nowhere", "1"]));
    assert!(code == 2 && stderr.contains("no run in nowhere"), "{stderr}");
}

#[test]
fn a_solver_that_was_changed_gives_other_bits_and_the_answer_says_by_how_much_and_what_was_changed() {
    let place = BadSolverStudy::new("");
    let (code, said) = place.told("run");
    assert_eq!(code, 0, "{said}");
    let out = place.path("out");
    let (code, found) = replayed(&out, &["1"]);
    assert!(code == 0 && found["agrees"] == true && found["changed"] == serde_json::json!([]), "{found}");
    let solver = std::fs::read_to_string(place.path("solver.py")).unwrap();
    place.write("solver.py", &solver.replace("print(", "excess = [(1 + 1e-9) * v for v in excess]\nprint("));
    let (code, found) = replayed(&out, &["1"]);
    assert_eq!((code, &found["agrees"]), (1, &false.into()), "{found}");
    let apart = found["runs"][0]["agreement"]["other_bits"]["relative"].as_f64().unwrap();
    // Each of twenty sums and products rounds to 1.1e-16 of itself, far below 1e-12.
    assert!((apart - 1e-9).abs() < 1e-12, "{found}");
    assert!(found["changed"][0].as_str().unwrap().contains("its file `solver.py` is another"), "{found}");
    let ends = "if abs(rate - 1) > 1e-9: sys.exit('no licence')\nprint(";
    place.write("solver.py", &solver.replace("print(", ends));
    let (code, found) = replayed(&out, &["1"]);
    let said = found["error"].as_str().unwrap();
    assert!(code == 1 && said.contains("ends abnormally wherever it is made"), "{said}");
    place.write("solver.py", &solver);
    place.write("cup.csv", &std::fs::read_to_string(place.path("cup.csv")).unwrap().replace("0.1,", "0.1,1"));
    let (code, _, stderr) = output(starlings().arg("replay").arg(&out).arg("1"));
    assert!(code == 2 && stderr.contains("the recordings changed since the run: `cup`"), "{stderr}");
}

#[test]
fn a_run_that_failed_is_made_again_beside_the_others_and_fails_with_the_same_words() {
    let place = BadSolverStudy::new("if rate < 0.96: sys.exit('cannot factor the matrix')");
    let (code, said) = place.told("run");
    assert_eq!(code, 0, "{said}");
    let out = place.path("out");
    let select = "SELECT step, particle FROM jobs WHERE pass = 1 AND status = 'failed' ORDER BY id LIMIT 1";
    let (step, particle): (usize, u32) = Connection::open(out.join("run.db"))
        .unwrap()
        .query_row(select, [], |row| Ok((row.get(0)?, row.get(1)?)))
        .unwrap();
    let (code, found) = replayed(&out, &[&particle.to_string(), "--analysis", &step.to_string()]);
    assert_eq!((code, &found["runs"][0]["agreement"]), (0, &"both_failed".into()), "{found}");
    let words = found["runs"][0]["now"]["failed"].as_str().unwrap();
    assert!(words.contains("cannot factor the matrix"), "{words}");
}

#[test]
fn a_run_before_the_one_that_is_meant_is_the_answer_where_its_bits_are_others_and_older_stores_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), "oscillator");
    let database = Connection::open(out.join("run.db")).unwrap();
    let stored: Vec<usize> = {
        let select = "SELECT step FROM inputs WHERE pass = 1 AND part = 'theta' ORDER BY step";
        let mut rows = database.prepare(select).unwrap();
        rows.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
    };
    let from = *stored.windows(2).find(|pair| pair[1] > pair[0] + 2).map(|pair| &pair[0]).unwrap();
    // As if the program had given another answer there.
    let spoil =
        format!("UPDATE jobs SET answer = zeroblob(16) WHERE pass = 1 AND step = {from} AND particle = 2");
    assert_eq!(database.execute(&spoil, []).unwrap(), 1);
    let (code, found) = replayed(&out, &["0", "--pass", "1", "--analysis", &(from + 2).to_string()]);
    assert_eq!(
        (code, &found["earlier"]["particle"], &found["earlier"]["analysis"]),
        (1, &2.into(), &from.into())
    );
    assert_eq!(found["runs"], serde_json::json!([]));
    database.execute_batch("DROP TABLE inputs").unwrap();
    drop(database);
    let (code, _, stderr) = output(starlings().arg("replay").arg(&out).arg("0"));
    assert!(code == 2 && stderr.contains("kept no inputs of its runs: run the study again"), "{stderr}");
}

#[test]
fn what_is_kept_for_a_replay_makes_the_database_a_fifth_larger_at_most() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["pig-aorta", "rcr", "oscillator", "fsi-tube"] {
        let out = run(folder.path(), name);
        let database = Connection::open(out.join("run.db")).unwrap();
        let one = |sql: &str| database.query_row(sql, [], |row| row.get::<_, f64>(0)).unwrap();
        let with = one("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
        database.execute_batch("DROP TABLE inputs; ALTER TABLE jobs DROP COLUMN answer; VACUUM").unwrap();
        let without = one("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
        println!("{name}: {:.1} % of {:.2} MB", 100.0 * (with / without - 1.0), without / 1e6);
        assert!(with < 1.2 * without, "{name}: {with} and {without} bytes");
    }
}
