//! `--traces`: one trace from the coordinator through the worker to the solver, in a file and at a collector.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod trace_kit;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use common::{bytes, output, starlings};
use serde_json::Value;
use trace_kit::{Collector, Span, handed_by_one_trace};

/// A program that adds where its run belongs in a trace to a file, and answers a straight line.
const PROGRAM: &str = "import json, os, sys
run = json.load(sys.stdin)
with open('SEEN', 'a') as seen:
    seen.write(os.environ.get('TRACEPARENT', 'none') + '\\n')
print(json.dumps({'y': [run['parameters']['slope'] * t for t in run['times']]}))
";

/// What the study says of it.
const MODEL: &str = r#"adapter = "command"
parameters = [{ name = "slope" }]
outputs = [{ name = "y" }]
"#;

/// The same as a solver of the Python package, which says of itself what it is.
const SOLVER: &str = "import starlings
@starlings.solver(parameters={'slope': ''}, outputs={'y': ''})
class Line:
    def run(self, window):
        with open('SEEN', 'a') as seen:
            seen.write((window.traceparent or 'none') + '\\n')
        return window.p.slope * window.times
if __name__ == '__main__':
    starlings.serve(Line)
";

/// A study of one of them; what it saw stands beside it, in `seen`.
fn study(folder: &Path, program: &str, model: &str) -> PathBuf {
    let seen = folder.join("seen");
    std::fs::write(folder.join("line.py"), program.replace("SEEN", seen.to_str().unwrap())).unwrap();
    std::fs::write(folder.join("data.csv"), "time,y\n1,2.1\n2,3.9\n3,6.05\n").unwrap();
    let text = format!(
        r#"[study]
name = "line"
[model]
kind = "solver"
command = ["python3", "line.py"]
{model}
[[parameters]]
name = "slope"
prior = {{ transform = "log", median = 1.0, factor = 2.0 }}
[[records]]
name = "one"
file = "data.csv"
channels = [{{ column = "y", output = "y", noise = 0.1 }}]
[estimator]
kind = "batch"
"#
    );
    let file = folder.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

/// The spans in a file.
fn spans(file: &Path) -> Vec<Span> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut found = Vec::new();
    for line in text.lines() {
        let request: Value = serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        for group in request["resourceSpans"].as_array().unwrap() {
            let attributes = group["resource"]["attributes"].as_array().unwrap();
            let role = attributes.iter().find(|one| one["key"] == "starlings.role").unwrap();
            let of = |span: &Value, key: &str| span[key].as_str().unwrap_or_default().to_owned();
            let scopes = group["scopeSpans"].as_array().unwrap();
            found.extend(scopes.iter().flat_map(|scope| scope["spans"].as_array().unwrap()).map(|span| {
                Span {
                    role: role["value"]["stringValue"].as_str().unwrap().to_owned(),
                    name: of(span, "name"),
                    trace: of(span, "traceId"),
                    id: of(span, "spanId"),
                    parent: of(span, "parentSpanId"),
                }
            }));
        }
    }
    found
}

#[test]
fn a_run_is_one_trace_from_the_coordinator_to_the_solver_and_its_result_is_the_same_without() {
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path(), PROGRAM, MODEL);
    // One worker: no run is made twice, and none is stopped half-way.
    let run = |out: &str, more: &[&str]| {
        let out = folder.path().join(out);
        let mut command = starlings();
        command.arg("run").arg(&file).arg("--out").arg(&out).args(["--workers", "1"]).args(more);
        let (code, _, stderr) = output(&mut command);
        assert_eq!(code, 0, "{stderr}");
        out
    };
    let plain = run("plain", &[]);
    let seen = folder.path().join("seen");
    assert!(std::fs::read_to_string(&seen).unwrap().lines().all(|line| line == "none"));
    std::fs::remove_file(&seen).unwrap();
    let traces = folder.path().join("spans.jsonl");
    let traced = run("traced", &["--traces", traces.to_str().unwrap()]);
    assert_eq!(bytes(&plain, "posterior.csv"), bytes(&traced, "posterior.csv"));

    // What the solver of every run saw is the span of its computation; before the fleet is there a trial run saw none.
    are_same(&handed(&seen), &handed_by_one_trace(&spans(&traces)));
}

/// What solvers were handed, as they wrote it down.
fn handed(seen: &Path) -> BTreeSet<String> {
    let seen = std::fs::read_to_string(seen).unwrap();
    seen.lines().filter(|line| *line != "none").map(str::to_owned).collect()
}

/// Expects solvers to have been handed what the trace says, all of it and nothing else.
fn are_same(handed: &BTreeSet<String>, traced: &BTreeSet<String>) {
    let not_traced: Vec<&String> = handed.difference(traced).collect();
    let not_handed: Vec<&String> = traced.difference(handed).collect();
    let (n_handed, n_traced) = (handed.len(), traced.len());
    assert!(
        not_traced.is_empty() && not_handed.is_empty(),
        "{n_handed} handed, {n_traced} traced: {} are not traced, {} were not handed",
        not_traced.len(),
        not_handed.len()
    );
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn a_collector_gets_the_runs_of_coordinator_and_worker_and_the_solver_in_python_knows_its_place_in_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path(), SOLVER, "");
    let collector = Collector::start();
    let mut command = starlings();
    command.arg("run").arg(file).arg("--out").arg(folder.path().join("out"));
    let (code, _, stderr) = output(
        command.args(["--workers", "1", "--traces", &collector.url]).env("PATH", common::python::path()),
    );
    assert_eq!(code, 0, "{stderr}");
    // Both have ended, and sent all that they had.
    are_same(&handed(&folder.path().join("seen")), &handed_by_one_trace(&collector.taken()));
}

#[test]
fn a_place_for_spans_that_is_none_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path(), PROGRAM, MODEL);
    let out = folder.path().join("out");
    for (target, says) in [
        ("https://collector:4318", "over http://"),
        ("/nowhere/at/all/spans.jsonl", "cannot write spans to /nowhere/at/all/spans.jsonl"),
    ] {
        let mut command = starlings();
        let (code, _, stderr) =
            output(command.arg("run").arg(&file).arg("--out").arg(&out).args(["--traces", target]));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(says), "{stderr}");
        assert!(!out.exists(), "nothing was written");
    }
}
