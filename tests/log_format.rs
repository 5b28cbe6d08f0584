//! `--log json`: every line on standard error is a JSON object with the fields of `docs/watching.md`.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod small_kit;

use std::process::{Child, Stdio};

use common::{output, starlings, wait_until};
use serde_json::Value;
use small_kit::{same, study, swap};

fn records(stderr: &str) -> Vec<Value> {
    let of = |line: &str| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
    stderr.lines().map(of).collect()
}

/// The fields of the first record of an event.
fn event<'a>(records: &'a [Value], name: &str) -> &'a Value {
    let found = records.iter().map(|record| &record["fields"]).find(|fields| fields["event"] == name);
    found.unwrap_or_else(|| panic!("no {name} in {records:#?}"))
}

#[test]
fn a_run_tells_its_events_as_objects_and_its_result_stays_on_standard_output() {
    let (folder, file) = study(same, same);
    let out = folder.path().join("out");
    let (code, stdout, stderr) =
        output(starlings().args(["--log", "json", "run", "--json"]).arg(&file).arg("--out").arg(&out));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(serde_json::from_str::<Value>(&stdout).expect("the summary")["study"], "small");
    let told = records(&stderr);
    let joined = event(&told, "worker-joined");
    assert_eq!(joined["run"], "small");
    assert!(joined["worker"].as_str().is_some_and(|name| name.starts_with("1@")), "{joined}");
    assert!(joined.get("particle").is_none(), "{joined}");
    let at = event(&told, "progress");
    assert_eq!((&at["stage"], &at["pass"], &at["step"]), (&"filter".into(), &1.into(), &0.into()), "{at}");
    let is_first = |record: &&Value| record["fields"]["pass"] == 1 && record["fields"]["step"] == 1;
    assert!(told.iter().any(|record| is_first(&record)), "the first analysis is told");
    assert!(at["steps"].as_u64() > Some(1) && at["workers"].is_u64() && at["runs"].is_u64(), "{at}");
    for record in &told {
        assert!(record["timestamp"].is_string() && record["level"].is_string(), "{record}");
        assert!(record["fields"]["message"].is_string(), "{record}");
    }
}

#[test]
fn a_study_that_is_wrong_is_told_with_its_place() {
    let (_folder, file) = study(swap("windkessel-2", "windkessel-9"), same);
    let (code, _, stderr) = output(starlings().arg("run").arg(&file).args(["--log", "json"]));
    assert_eq!(code, 2, "{stderr}");
    let told = records(&stderr);
    let wrong = told.iter().find(|record| record["level"] == "ERROR").expect("an error");
    assert_eq!(wrong["fields"]["line"], 5, "{wrong}");
    assert!(wrong["fields"]["message"].as_str().is_some_and(|says| says.contains("windkessel-9")), "{wrong}");
}

#[test]
fn a_command_ends_in_order_with_the_program_that_started_it() {
    let (folder, file) = study(same, same);
    let mut run = starlings();
    // Nobody dials: without the end of standard input it would wait.
    run.args(["--end-with-stdin", "run"]).arg(&file).args(["--listen", "127.0.0.1:0", "--out"]);
    run.arg(folder.path().join("out")).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut run = run.spawn().expect("a coordinator");
    let access = folder.path().join("out").join("access.json");
    wait_until("the access file", || std::fs::metadata(&access).is_ok_and(|file| file.len() > 0));
    drop(run.stdin.take());
    let ended = run.wait_with_output().expect("its end");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(129), "{said}");
    assert!(said.contains("--resume"), "{said}");
}

/// Kills the coordinator with the test.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_worker_tells_the_run_and_its_connection_and_every_run_of_the_model() {
    let (folder, file) = study(same, same);
    let access = folder.path().join("access.json");
    let mut run = starlings();
    run.arg("run").arg(&file).arg("--out").arg(folder.path().join("out"));
    run.args(["--listen", "127.0.0.1:0", "--access"]).arg(&access);
    let run = run.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let _run = Ends(run.expect("a coordinator"));
    wait_until("the access file", || std::fs::metadata(&access).is_ok_and(|file| file.len() > 0));
    let (code, _, stderr) = output(
        starlings()
            .args(["worker", "--slots", "1", "--once", "--log", "json", "-v", "--access"])
            .arg(&access),
    );
    assert_eq!(code, 0, "{stderr}");
    let told = records(&stderr);
    let connected = event(&told, "connected");
    assert_eq!(connected["run"], "small");
    assert!(connected["worker"].as_str().is_some_and(|name| name.contains('/')), "{connected}");
    let ran = event(&told, "ran");
    assert_eq!(ran["epoch"], connected["epoch"], "{ran}");
    assert!(ran["particle"].is_u64() && ran["record"].is_u64() && ran["seconds"].is_f64(), "{ran}");
    assert_eq!(event(&told, "ended")["epoch"], connected["epoch"]);
}
