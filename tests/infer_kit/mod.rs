//! Two coupled decays: their study, recordings under noise, and how a test infers them.

#![allow(dead_code)] // every test file uses its own part

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use tempfile::TempDir;

use crate::common::{output, starlings};

pub(crate) const STUDY: &str = r#"
[study]
name = "decay"

[model]
kind = "equations"
constants = { level = 0.0 }
outputs = [ { name = "x", value = "x" }, { name = "both", value = "x + z" }, { name = "z", value = "z" } ]

[[model.states]]
name = "x"
rate = "-k*(x - level) + c*z"

[[model.states]]
name = "z"
rate = "-c*x - d*z"

[infer]
parameters = ["k", "c", "d"]
block = 300

[infer.follow]
block = 200
recent = 1
least = 1000

[[records]]
name = "path"
file = "data.csv"
channels = [ { column = "x", output = "x" }, { column = "z", output = "z" } ]
"#;

/// Numbers of mean zero and variance one, of a linear congruential generator.
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    // Twelve uniform numbers less six have a variance of one.
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Rows of two coupled decays under noise of a linear congruential generator; from row `change` on they are coupled twice as strongly.
pub(crate) fn recording(n: usize, change: usize) -> String {
    coupled(n, change, 6.0)
}

/// The same with any coupling from row `change` on, which before is 3.
pub(crate) fn coupled(n: usize, change: usize, coupling: f64) -> String {
    let (mut noise, mut x, mut z, h) = (noise(1), 0.0_f64, 0.0_f64, 0.01);
    let mut text = "time,x,z\n".to_owned();
    for k in 0..=n {
        writeln!(text, "{:?},{x:?},{z:?}", k as f64 / 100.0).unwrap();
        let c = if k < change { 3.0 } else { coupling };
        let (dx, dz) = (-2.0 * x + c * z, -c * x - z);
        (x, z) = (x + h * dx + 0.05 * noise(), z + h * dz + 0.05 * noise());
    }
    text
}

pub(crate) fn folder(study: &str, data: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("study.toml"), study).unwrap();
    fs::write(dir.path().join("data.csv"), data).unwrap();
    dir
}

pub(crate) fn infer(dir: &Path, out: &str, workers: &str) -> Value {
    let arguments = ["infer", "study.toml", "--out", out, "--workers", workers, "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir).args(arguments));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

/// Expects a study to be refused with every one of `words` and exit code 2.
pub(crate) fn refused(study: &str, data: &str, words: &[&str]) {
    let dir = folder(study, data);
    let arguments = ["infer", "study.toml", "--out", "out", "--workers", "1"];
    crate::common::refused(starlings().current_dir(dir.path()).args(arguments), words);
    assert!(!dir.path().join("out/infer.json").exists(), "no result of what was refused");
}

/// Lines of a followed recording.
pub(crate) fn followed(dir: &Path, data: &str, arguments: &[&str]) -> (i32, Vec<String>, String) {
    let mut command = starlings();
    command.current_dir(dir).args(["infer", "study.toml", "--follow", "-"]).args(arguments);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // Lines are read while rows are written, since a pipe holds few. A command that refuses a row reads no more.
    let out = std::thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(data.as_bytes()));
        child.wait_with_output().unwrap()
    });
    let lines = String::from_utf8(out.stdout).unwrap().lines().map(str::to_owned).collect();
    (out.status.code().unwrap(), lines, String::from_utf8(out.stderr).unwrap())
}

/// Warnings that hold these words.
pub(crate) fn said<'a>(found: &'a Value, words: &str) -> Vec<&'a str> {
    let all = found["warnings"].as_array().unwrap().iter().map(|warning| warning.as_str().unwrap());
    all.filter(|warning| warning.contains(words)).collect()
}

/// A study of states by their rates, whose parameters are asked for.
pub(crate) fn by_rates(states: &[(&str, &str)], infer: &str) -> String {
    let mut text = "[study]\nname = \"path\"\n[model]\nkind = \"equations\"\n".to_owned();
    let list = |each: &dyn Fn(&str) -> String| {
        states.iter().map(|(name, _)| each(name)).collect::<Vec<_>>().join(", ")
    };
    writeln!(text, "outputs = [ {} ]", list(&|x| format!("{{ name = \"{x}\", value = \"{x}\" }}"))).unwrap();
    for (name, rate) in states {
        writeln!(text, "[[model.states]]\nname = \"{name}\"\nrate = \"{rate}\"").unwrap();
    }
    writeln!(text, "[infer]\n{infer}\n[[records]]\nname = \"path\"\nfile = \"data.csv\"").unwrap();
    let columns = list(&|x| format!("{{ column = \"{x}\", output = \"{x}\" }}"));
    writeln!(text, "channels = [ {columns} ]").unwrap();
    text
}
