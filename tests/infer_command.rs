//! `starlings infer`: the same bytes whoever makes the sums, refusals with their remedy, a recording that is followed.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Stdio;

use common::{output, starlings};
use serde_json::Value;
use tempfile::TempDir;

const STUDY: &str = r#"
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

/// Rows of two coupled decays under noise of a linear congruential generator; from row `change` on they are coupled twice as strongly.
fn recording(n: usize, change: usize) -> String {
    let (mut state, mut x, mut z, h) = (1_u64, 0.0_f64, 0.0_f64, 0.01);
    let mut noise = || {
        // Twelve uniform numbers less six have a variance of one.
        let uniform = |state: &mut u64| {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0
    };
    let mut text = "time,x,z\n".to_owned();
    for k in 0..=n {
        writeln!(text, "{:?},{x:?},{z:?}", k as f64 / 100.0).unwrap();
        let c = if k < change { 3.0 } else { 6.0 };
        let (dx, dz) = (-2.0 * x + c * z, -c * x - z);
        (x, z) = (x + h * dx + 0.05 * noise(), z + h * dz + 0.05 * noise());
    }
    text
}

fn folder(study: &str, data: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("study.toml"), study).unwrap();
    fs::write(dir.path().join("data.csv"), data).unwrap();
    dir
}

fn infer(dir: &Path, out: &str, workers: &str) -> Value {
    let arguments = ["infer", "study.toml", "--out", out, "--workers", workers, "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir).args(arguments));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

#[test]
fn one_two_and_three_workers_give_the_same_bytes() {
    let dir = folder(STUDY, &recording(5000, usize::MAX));
    let found = infer(dir.path(), "one", "1");
    for (out, workers) in [("two", "2"), ("three", "3")] {
        infer(dir.path(), out, workers);
        for file in ["infer.json", "coefficients.csv", "report.html", "study.toml"] {
            let read = |folder: &str| fs::read(dir.path().join(folder).join(file)).unwrap();
            assert_eq!(read("one"), read(out), "{file}");
        }
    }
    for (name, truth) in [("k", 2.0), ("c", 3.0), ("d", 1.0)] {
        let entry = found["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap();
        let (estimate, sd) = (entry["estimate"].as_f64().unwrap(), entry["sd"].as_f64().unwrap());
        // Four sd, and the error of the mid-point for a path of Euler's method: 1 % of the rates of decay.
        assert!((estimate - truth).abs() < 4.0 * sd + 0.1, "{name}: {estimate} ± {sd}");
    }
    assert_eq!(found["convergence"].as_array().unwrap().len(), 6, "after 1, 2, 4, 8, 16 and all 17 blocks");
    let (code, _, stderr) = output(starlings().current_dir(dir.path()).args(["report", "two"]));
    assert_eq!(code, 0, "{stderr}");
}

/// Expects a study to be refused with every one of `words` and exit code 2.
fn refused(study: &str, data: &str, words: &[&str]) {
    let dir = folder(study, data);
    let arguments = ["infer", "study.toml", "--out", "out", "--workers", "1"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(arguments));
    let flat =
        stderr.split_whitespace().filter(|w| !matches!(*w, "│" | "×" | "╰─▶")).collect::<Vec<_>>().join(" ");
    assert_eq!(code, 2, "{stderr}");
    assert_eq!(stdout, "");
    for word in words {
        assert!(flat.contains(word), "no `{word}` in: {flat}");
    }
    assert!(!dir.path().join("out/infer.json").exists(), "no result of what was refused");
}

#[test]
fn a_recording_out_of_step_is_refused_with_its_line() {
    let good = recording(2000, usize::MAX);
    let lines: Vec<&str> = good.lines().collect();
    let without = |row: usize| [&lines[..row], &lines[row + 1..]].concat().join("\n");
    refused(STUDY, &without(700), &["data.csv:701", "time jumps from 6.98 to 7", "gaps = \"break\""]);
    let twice = [&lines[..700], &lines[699..]].concat().join("\n");
    refused(STUDY, &twice, &["data.csv:701", "not later than", "one row per time"]);
    let late = good.replace("\n7.0,", "\n7.004,");
    refused(STUDY, &late, &["data.csv:702", "the step from 6.99 to 7.004", "resample"]);
    refused(
        STUDY,
        &good.replace("\n7.0,", "\n7.0,sensor"),
        &["data.csv:702", "`sensor", "column `x`", "not a finite number"],
    );
    refused(STUDY, &good.replace("\n7.0,", "\n7.0,,"), &["data.csv:702"]);
    refused(STUDY, "time,x,z\n", &["data.csv", "too few rows"]);
    refused(STUDY, &good.replace("time,x,z", "time,x,y"), &["no column `z`"]);
    let broken = folder(&STUDY.replace("block = 300", "block = 300\ngaps = \"break\""), &without(700));
    let found = infer(broken.path(), "out", "1");
    assert_eq!(found["n_step"], 1998, "two steps are lost with the row");
}

#[test]
fn what_cannot_be_estimated_is_refused_with_names() {
    let data = recording(2000, usize::MAX);
    let of_functions = |functions: &str| STUDY.replace(r#"parameters = ["k", "c", "d"]"#, functions);
    let collinear = of_functions(r#"functions = ["x", "z", "2*x - z"]"#);
    refused(&collinear, &data, &["cannot tell these terms apart", "x:2*x - z", "x:x"]);
    let few = data.lines().take(4).collect::<Vec<_>>().join("\n");
    refused(
        &of_functions("basis = \"polynomial\""),
        &few,
        &["2 steps do not determine the 5 unknowns", "record longer"],
    );
    let twice = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let last = if cells[0] == "time" { "z" } else { cells[1] };
        [cells[0], cells[1], last].join(",")
    };
    let same = data.lines().map(twice).collect::<Vec<_>>().join("\n");
    refused(&of_functions(r#"functions = ["x"]"#), &same, &["no positive definite covariance"]);
    refused(
        &of_functions(r#"functions = ["log(x)"]"#),
        &data,
        &["data.csv:", "log(x) is NaN in the step that begins in this row", "leave out the function"],
    );
}

#[test]
fn a_section_that_does_not_fit_is_refused_with_place_and_remedy() {
    let data = recording(100, usize::MAX);
    let changed = |from: &str, to: &str| {
        assert!(STUDY.contains(from));
        STUDY.replace(from, to)
    };
    let asked = r#"parameters = ["k", "c", "d"]"#;
    refused(&changed("block = 300", "blok = 300"), &data, &["unknown key `blok` in [infer]", "`block`"]);
    refused(&changed(asked, r#"parameters = ["k", "c", "q"]"#), &data, &["named `q`", "study.toml:"]);
    refused(
        &changed("rate = \"-c*x - d*z\"", "rate = \"-c^2*x - d*z\""),
        &data,
        &["not linear in `c`", "rate of `z`"],
    );
    refused(&changed(asked, "diffusion = \"full\""), &data, &["[infer] asks for nothing"]);
    refused(
        &changed(asked, &format!("{asked}\nbasis = \"polynomial\"")),
        &data,
        &["keep `parameters`, or `basis`"],
    );
    refused(
        &changed(asked, &format!("{asked}\ndiffusion = \"fall\"")),
        &data,
        &["unknown diffusion `fall`", "`full`"],
    );
    refused(&changed(asked, &format!("{asked}\nrule = {{ q = \"ito\" }}")), &data, &["`rule` names `q`"]);
    refused(
        &changed(", { column = \"z\", output = \"z\" }", ""),
        &data,
        &["no channel", "measures state `z`"],
    );
    refused(&changed("output = \"z\"", "output = \"both\""), &data, &["`both` is no state by itself"]);
    refused(&changed("file = \"data.csv\"", "file = \"dada.csv\""), &data, &["dada.csv", "cannot be read"]);
    refused(&STUDY.replace("[infer", "[infer_"), &data, &["unknown key"]);
    let prior =
        "\n[[parameters]]\nname = \"k\"\nprior = { transform = \"log\", median = 2.0, factor = 2.0 }\n";
    refused(&format!("{STUDY}{prior}"), &data, &["Gaussian under log", "transform = \"linear\""]);
}

#[test]
fn a_prior_holds_where_the_data_say_little() {
    let prior =
        "\n[[parameters]]\nname = \"k\"\nprior = { transform = \"linear\", median = 2.5, sd = 1e-4 }\n";
    let dir = folder(&format!("{STUDY}{prior}"), &recording(2000, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    let k = &found["coefficients"][0];
    assert!((k["estimate"].as_f64().unwrap() - 2.5).abs() < 3e-4, "{k}");
    assert_eq!(k["prior"][1], 1e-4);
}

/// Lines of a followed recording.
fn followed(dir: &Path, data: &str, arguments: &[&str]) -> (i32, Vec<String>, String) {
    let mut command = starlings();
    command.current_dir(dir).args(["infer", "study.toml", "--follow", "-"]).args(arguments);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // A command that refuses a row reads no more.
    let _ = child.stdin.take().unwrap().write_all(data.as_bytes());
    let out = child.wait_with_output().unwrap();
    let lines = String::from_utf8(out.stdout).unwrap().lines().map(str::to_owned).collect();
    (out.status.code().unwrap(), lines, String::from_utf8(out.stderr).unwrap())
}

#[test]
fn a_change_is_an_alarm_where_it_happens_and_nowhere_else() {
    // A thousand steps tell a doubled coupling by about fifty units of χ².
    let dir = folder(&STUDY.replace("block = 200", "block = 1000"), "");
    let (code, lines, stderr) = followed(dir.path(), &recording(12_000, 8_000), &[]);
    assert_eq!(code, 0, "{stderr}");
    let lines: Vec<Value> = lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 12, "a line per block of 1000");
    let alarms: Vec<f64> = lines
        .iter()
        .filter(|line| line["alarm"] == true)
        .map(|line| line["time"].as_f64().unwrap())
        .collect();
    assert_eq!(alarms, [90.0], "the coupling doubles at 80, and the block after that ends at 90");
    let last = &lines[11]["coefficients"]["c"];
    let (c, sd) = (last[0].as_f64().unwrap(), last[1].as_f64().unwrap());
    // As above: four sd and the error of Euler's path.
    assert!((c - 6.0).abs() < 4.0 * sd + 0.2, "after the change all is estimated anew: {c} ± {sd}");
}

#[test]
fn a_restart_goes_on_with_the_same_lines() {
    let dir = folder(STUDY, "");
    let data = recording(6_000, 4_000);
    let (_, whole, _) = followed(dir.path(), &data, &[]);
    let rows: Vec<&str> = data.lines().collect();
    // Cut in the middle of a block: what came after the last line is given again.
    let (_, mut parts, _) =
        followed(dir.path(), &(rows[..2_500].join("\n") + "\n"), &["--state", "state.json"]);
    let (code, rest, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
    assert_eq!(code, 0, "{stderr}");
    parts.extend(rest);
    assert_eq!(parts, whole);
}

#[test]
fn the_state_of_another_study_is_refused() {
    let dir = folder(STUDY, "");
    let data = recording(1_500, usize::MAX);
    let (code, _, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
    assert_eq!(code, 0, "{stderr}");
    let changes = [
        ("recent = 1", "recent = 2"),
        ("level = 0.0", "level = 1.0"),
        ("block = 300", "diffusion = \"diagonal\""),
        ("block = 300", "prefactor = false"),
        ("block = 300", "measurement_noise = \"none\""),
        ("rate = \"-c*x - d*z\"", "rate = \"-c*x - 2*d*z\""),
        ("column = \"z\"", "column = \"x\""),
    ];
    for (from, to) in changes {
        assert!(STUDY.contains(from));
        fs::write(dir.path().join("study.toml"), STUDY.replace(from, to)).unwrap();
        let (code, lines, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
        assert!(code == 2 && stderr.contains("state of another study"), "{to}: {stderr}");
        assert!(lines.is_empty(), "{to}: {lines:?}");
    }
}

#[test]
fn a_stream_that_stops_repeats_jumps_or_holds_text_is_told_with_its_line() {
    let dir = folder(STUDY, "");
    let good = recording(1_000, usize::MAX);
    let lines: Vec<&str> = good.lines().collect();
    let cases = [
        (lines[..100].join("\n") + "\n", "ended after 98 steps"),
        ([&lines[..700], &lines[699..]].concat().join("\n"), "standard input:701: time 6.98 of row"),
        ([&lines[..700], &lines[701..]].concat().join("\n"), "standard input:701: time jumps"),
        (good.replace("\n7.0,", "\n7.0,off"), "standard input:702: `off"),
        ("time,x\n".to_owned(), "no column `z`"),
        (String::new(), "the file is empty"),
    ];
    for (data, says) in cases {
        let (code, _, stderr) = followed(dir.path(), &data, &[]);
        assert!(code == 2 && stderr.contains(says), "no `{says}` in: {stderr}");
    }
}

#[test]
fn a_stream_whose_terms_cannot_be_told_apart_says_so_in_every_line_and_once_beside_them() {
    let collinear = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x", "z", "2*x - z"]"#);
    let dir = folder(&collinear, "");
    let (code, lines, stderr) = followed(dir.path(), &recording(1_000, usize::MAX), &[]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(lines.len(), 5);
    for line in lines {
        let line: Value = serde_json::from_str(&line).unwrap();
        assert!(line["error"].as_str().unwrap().contains("cannot tell these terms apart"), "{line}");
        assert!(line["diffusion"].is_null(), "{line}");
    }
    assert_eq!(stderr.matches("cannot tell these terms apart").count(), 1, "{stderr}");
}

#[test]
fn a_stream_with_errors_of_the_measurement_has_the_noise_of_the_whole_inference() {
    let mut state = 1_u64;
    let mut error = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.2 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    let mut data = "time,x,z\n".to_owned();
    for line in recording(1_000, usize::MAX).lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        writeln!(data, "{:?},{:?},{:?}", cells[0], cells[1] + error(), cells[2] + error()).unwrap();
    }
    let study = STUDY.replace("block = 200", "block = 1000").replace("[infer]", "[infer]\nMEASURED");
    for (word, corrected) in [("auto", true), ("none", false)] {
        let study = study.replace("MEASURED", &format!("measurement_noise = \"{word}\""));
        let dir = folder(&study, &data);
        let whole = infer(dir.path(), "out", "1");
        assert_eq!(whole["diffusion"]["lag_corrected"], corrected);
        let (code, lines, stderr) = followed(dir.path(), &data, &[]);
        assert_eq!(code, 0, "{stderr}");
        let line: Value = serde_json::from_str(&lines[0]).unwrap();
        assert_eq!(line["lag_corrected"], corrected, "{line}");
        for l in 0..2 {
            let [one, other] =
                [&line["diffusion"][l], &whole["diffusion"]["matrix"][l][l]].map(|v| v.as_f64().unwrap());
            // The same sums, added in another order.
            assert!((one / other - 1.0).abs() < 1e-6, "{word}: {one} and {other}");
        }
    }
}

#[test]
fn what_needs_a_whole_recording_is_refused_for_a_stream() {
    let reduced = "\n[infer.reduced]\nstart = { a = 1.0 }\ncoefficients = { k = \"a\" }\n";
    let cases = [
        (STUDY.replace("block = 300", "measurement_noise = 0.1"), "a given `measurement_noise`"),
        (STUDY.replace("block = 300", "richardson = true"), "`richardson` is not part of --follow"),
        (format!("{STUDY}{reduced}"), "[infer.reduced] is not part of --follow"),
    ];
    for (study, says) in cases {
        let dir = folder(&study, "");
        let (code, lines, stderr) = followed(dir.path(), &recording(500, usize::MAX), &[]);
        assert!(code == 2 && lines.is_empty() && stderr.contains(says), "no `{says}` in: {stderr}");
    }
}

#[test]
fn half_a_row_at_the_end_of_a_stream_is_not_taken() {
    let dir = folder(STUDY, "");
    let data = recording(400, usize::MAX);
    // The last row closes the second block, and half of its last number is a number.
    let half = &data[..data.len() - 4];
    let (code, lines, stderr) = followed(dir.path(), half, &[]);
    assert!(code == 0 && lines.len() == 1, "{lines:?} {stderr}");
    assert!(stderr.contains("ended after 399 steps") && stderr.contains("was not taken"), "{stderr}");
    let (_, lines, stderr) = followed(dir.path(), &data, &[]);
    assert!(lines.len() == 2 && !stderr.contains("was not taken"), "{stderr}");
}

#[test]
fn a_name_over_two_lines_is_one_line_of_the_table() {
    let study = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x", "x *\n  z"]"#);
    let dir = folder(&study, &recording(1_000, usize::MAX));
    infer(dir.path(), "out", "1");
    let table = fs::read_to_string(dir.path().join("out/coefficients.csv")).unwrap();
    assert!(table.lines().all(|line| line.split(',').count() >= 7), "{table}");
    assert!(table.contains("\nx:x * z,"), "{table}");
}

#[test]
fn a_reduced_model_is_fitted_to_extrapolated_coefficients() {
    let reduced = "\n[infer.reduced]\nstart = { a = 1.0, b = 1.0, e = 1.0 }\ncoefficients = { k = \"a\", c = \"b\", d = \"e\" }\n";
    let study = STUDY.replace("block = 300", "richardson = true") + reduced;
    let dir = folder(&study, &recording(2_000, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    for k in 0..3 {
        let (of, unknown) = (&found["coefficients"][k], &found["reduced"]["unknowns"][k]);
        let [moved, before, same] =
            [&of["estimate"], &of["at_step"], &unknown["estimate"]].map(|v| v.as_f64().unwrap());
        // As many unknowns as coefficients: the reduced model is the coefficients, as far as its search converges.
        assert!((moved - same).abs() < 1e-6 && (before - same).abs() > 1e-4, "{of} {unknown}");
    }
}

#[test]
fn a_step_that_cannot_be_fitted_leaves_the_estimate_where_it_is() {
    let study = STUDY.replace("block = 300", "richardson = true");
    let dir = folder(&study, &recording(12, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    let warning = found["warnings"][0].as_str().unwrap();
    assert!(warning.contains("`richardson`") && warning.contains("at steps of 2h"), "{warning}");
    assert!(found["richardson"].is_null() && found["coefficients"][0]["estimate"].is_f64(), "{found}");
}

/// What `starlings check` says, and whether it takes the study.
fn checked(study: &str, data: &str) -> (i32, String) {
    let dir = folder(study, data);
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(["check", "study.toml"]));
    (code, stdout + &stderr)
}

#[test]
fn keys_that_do_not_fit_together_are_refused_before_anything_is_read() {
    let data = recording(500, usize::MAX);
    let (code, says) = checked(STUDY, &data);
    assert!(
        code == 0 && says.contains("coefficients  3: k, c, d") && says.contains("steps of 0.01"),
        "{says}"
    );
    let with = |lines: &str| STUDY.replace("block = 300", lines);
    let reduced = "\n[infer.reduced]\nstart = { a = 1.0 }\ncoefficients = { kk = \"a\" }\n";
    let nothing = "\n[infer.candidates]\nfunctions = [\"x\"]\n";
    let functions = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x"]"#);
    let cases = [
        (format!("{STUDY}{reduced}"), "there is no coefficient `kk`"),
        (with("measurement_noise = 0.1\nrichardson = true"), "remove `richardson`"),
        (with("measurement_noise = 0.1\ngaps = \"break\""), "remove gaps"),
        (format!("{functions}{nothing}"), "names no term that the model has not already"),
    ];
    for (study, says) in cases {
        let (code, found) = checked(&study, &data);
        assert!(code == 2 && found.contains(says), "no `{says}` in: {found}");
        // Without a recording: the question is asked first.
        refused(&study.replace("data.csv", "none.csv"), &data, &[&says[..10]]);
    }
    let (code, found) = checked(&format!("{STUDY}\n[infer.candidates]\nmost = 2\n"), &data);
    assert!(code == 2 && found.contains("names no candidate"), "{found}");
}

/// The study with another rate of `x` and monomials up to the second degree as candidates.
fn lacking(rate: &str, parameters: &str) -> String {
    let candidates = "\n[infer.candidates]\ndegree = 2\n";
    let later = "\n[[records]]\nname = \"later\"\nfile = \"later.csv\"\nuse = \"held-out\"\n\
                 channels = [ { column = \"x\", output = \"x\" }, { column = \"z\", output = \"z\" } ]\n";
    let study = STUDY.replace("-k*(x - level) + c*z", rate);
    let study = study.replace(r#"parameters = ["k", "c", "d"]"#, parameters);
    format!("{study}{candidates}{later}")
}

#[test]
fn a_term_that_the_rates_lack_is_named_alone_and_nothing_where_none_is() {
    let data = recording(6_000, usize::MAX);
    let lines: Vec<&str> = data.lines().collect();
    let (train, later) = (lines[..4_001].join("\n"), [&lines[..1], &lines[4_001..]].concat().join("\n"));
    let made = |study: &str| {
        let dir = folder(study, &train);
        fs::write(dir.path().join("later.csv"), &later).unwrap();
        let found = infer(dir.path(), "one", "1");
        assert_eq!(found, infer(dir.path(), "two", "2"), "the same whoever makes the sums");
        let page = fs::read_to_string(dir.path().join("one/report.html")).unwrap();
        assert!(page.contains("Terms that the drift may lack"));
        found
    };
    // Without the coupling c z in the first rate; the second has it.
    let found = made(&lacking("-k*x", r#"parameters = ["k", "c", "d"]"#));
    let missing = &found["missing"];
    let names: Vec<&str> =
        missing["named"].as_array().unwrap().iter().map(|named| named["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["x:z"], "{missing}");
    let verdict = found["verdict"].as_str().unwrap();
    assert!(verdict.contains("the drift lacks x:z"), "{verdict}");
    let [lo, hi] = [0, 1].map(|end| missing["named"][0]["interval90"][end].as_f64().unwrap());
    // Euler's path: rates are wrong by one in a hundred or so at the mid-point.
    assert!(lo - 0.5 < 3.0 && 3.0 < hi + 0.5, "{lo} to {hi}");
    // Half of h (3 z)² / D per step, where z has a variance of a tenth of a unit, is some nats in a hundred steps.
    assert!(missing["held_out"]["gain"].as_f64().unwrap() > 5.0, "{missing}");
    assert_eq!(missing["held_out"]["n_step"], 2000);
    // With it the others are those of the whole model.
    let k = missing["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == "k").unwrap();
    assert!((k["estimate"].as_f64().unwrap() - 2.0).abs() < 4.0 * k["sd"].as_f64().unwrap() + 0.1, "{k}");
    let found = made(&lacking("-k*x + c*z", r#"parameters = ["k", "c", "d"]"#));
    assert_eq!(found["missing"]["named"].as_array().unwrap().len(), 0, "{}", found["missing"]);
    assert!(found["verdict"].as_str().unwrap().contains("no term is missing"), "{}", found["verdict"]);
}

#[test]
fn a_known_error_of_the_measurement_is_smoothed_where_the_recording_itself_has_no_fit() {
    let mut state = 1_u64;
    let mut error = || {
        let uniform = |state: &mut u64| {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1_u64 << 53) as f64
        };
        0.5 * ((0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0)
    };
    let mut data = "time,x,z\n".to_owned();
    for line in recording(1_500, usize::MAX).lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        writeln!(data, "{:?},{:?},{:?}", cells[0], cells[1] + error(), cells[2] + error()).unwrap();
    }
    refused(&STUDY.replace("block = 300", "measurement_noise = \"none\""), &data, &["have not settled"]);
    let dir = folder(&STUDY.replace("block = 300", "measurement_noise = 0.5"), &data);
    let found = infer(dir.path(), "out", "2");
    let of = found["convergence_of"].as_str().unwrap();
    assert!(of.contains("before smoothing"), "{of}");
    let noise = found["diffusion"]["matrix"][0][0].as_f64().unwrap();
    // 2 M/h of the raw residuals is 50, and D is a quarter.
    assert!(noise < 5.0, "{noise}");
}

#[test]
fn rows_at_unequal_times_are_interpolated_by_request_with_the_noise_that_they_had() {
    // Every row of the path but those whose number is drawn: of twenty thousand steps of 10 ms about a third is left out.
    let data = recording(20_000, usize::MAX);
    let mut state = 7_u64;
    let mut dropped = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40).is_multiple_of(3)
    };
    let kept: Vec<&str> =
        data.lines().enumerate().filter(|(k, _)| *k < 2 || !dropped()).map(|(_, l)| l).collect();
    let kept = kept.join("\n");
    refused(STUDY, &kept, &["data.csv:"]);
    let study = STUDY.replace("block = 300", "resample = 0.04\ngaps = \"break\"");
    let found = infer(folder(&study, &kept).path(), "out", "2");
    let warning = found["warnings"][0].as_str().unwrap();
    assert!(warning.contains("interpolated to equal steps"), "{warning}");
    for l in 0..2 {
        let noise = found["diffusion"]["matrix"][l][l].as_f64().unwrap();
        // D is a quarter. Rows are 15 ms apart on average, longer ones weigh more: single steps of 40 ms alone would have lost a sixth.
        assert!((noise / 0.25 - 1.0).abs() < 0.1, "{noise}");
    }
    let c = found["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == "c").unwrap();
    let (estimate, sd) = (c["estimate"].as_f64().unwrap(), c["sd"].as_f64().unwrap());
    // Steps of 40 ms move the rates by (c h)² / 12 and interpolation by as much.
    assert!((estimate - 3.0).abs() < 4.0 * sd + 0.1, "{estimate} ± {sd}");
    let dir = folder(&study.replace("resample", "richardson = true\nresample"), &kept);
    let (code, _, stderr) = output(starlings().current_dir(dir.path()).args(["check", "study.toml"]));
    assert!(code == 2 && stderr.contains("remove it, or `resample`"), "{stderr}");
}
