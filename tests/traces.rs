//! `--traces`: one trace from the coordinator through the worker to the solver.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use common::{bytes, output, starlings};
use serde_json::Value;

/// A study of a program that adds where its run belongs in a trace to a file, and answers a straight line.
fn study(folder: &Path) -> PathBuf {
    let program = "import json, os, sys\n\
                   run = json.load(sys.stdin)\n\
                   with open('seen', 'a') as seen:\n    seen.write(os.environ.get('TRACEPARENT', 'none') + '\\n')\n\
                   print(json.dumps({'y': [run['parameters']['slope'] * t for t in run['times']]}))\n";
    // Relative paths are those of the run's own folder: what was seen stands beside the study.
    let program = program.replace("'seen'", &format!("{:?}", folder.join("seen").display().to_string()));
    std::fs::write(folder.join("line.py"), program).unwrap();
    std::fs::write(folder.join("data.csv"), "time,y\n1,2.1\n2,3.9\n3,6.05\n").unwrap();
    let text = r#"[study]
name = "line"
[model]
kind = "solver"
adapter = "command"
command = ["python3", "line.py"]
parameters = [{ name = "slope" }]
outputs = [{ name = "y" }]
[[parameters]]
name = "slope"
prior = { transform = "log", median = 1.0, factor = 2.0 }
[[records]]
name = "one"
file = "data.csv"
channels = [{ column = "y", output = "y", noise = 0.1 }]
[estimator]
kind = "batch"
"#;
    let file = folder.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

/// A span as it stands in a file, with the role of its process.
#[derive(Debug)]
struct Span {
    role: String,
    name: String,
    trace: String,
    id: String,
    parent: String,
}

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
    let file = study(folder.path());
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

    let spans = spans(&traces);
    let by_id: BTreeMap<&str, &Span> = spans.iter().map(|span| (span.id.as_str(), span)).collect();
    let roots = spans.iter().filter(|span| span.parent.is_empty()).collect::<Vec<_>>();
    let [root] = roots[..] else { panic!("{roots:?}") };
    assert_eq!((root.role.as_str(), root.name.as_str()), ("coordinator", "study"));
    assert!(spans.iter().all(|span| span.trace == root.trace), "{spans:?}");
    let above =
        |span: &Span| by_id.get(span.parent.as_str()).map(|span| (span.role.as_str(), span.name.as_str()));
    let computed = spans.iter().filter(|span| span.name == "compute").collect::<Vec<_>>();
    for span in &spans {
        match span.name.as_str() {
            "run" => assert_eq!(above(span), Some(("coordinator", "study")), "{span:?}"),
            "compute" => {
                assert_eq!((span.role.as_str(), above(span)), ("worker", Some(("coordinator", "run"))));
            }
            other => assert_eq!(other, "study"),
        }
    }
    // What the solver of every run saw is the span of its computation; before the fleet is there a trial run saw none.
    let seen = std::fs::read_to_string(&seen).unwrap();
    let told: BTreeSet<String> = seen.lines().filter(|line| *line != "none").map(str::to_owned).collect();
    let wanted: BTreeSet<String> =
        computed.iter().map(|span| format!("00-{}-{}-01", span.trace, span.id)).collect();
    assert!(!wanted.is_empty());
    assert_eq!(told, wanted);
}

#[test]
fn a_place_for_spans_that_is_none_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path());
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
