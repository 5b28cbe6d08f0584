//! `starlings infer` on recordings and studies from which nothing can be inferred: refusals with place and remedy.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use common::{output, starlings};
use infer_kit::{STUDY, folder, infer, recording, refused};

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
fn a_treatment_of_outliers_has_no_place_in_an_inference() {
    let said = STUDY.replacen("output = \"x\"", "output = \"x\", outliers = \"keep\"", 1);
    assert_ne!(said, STUDY);
    refused(&said, &recording(2000, usize::MAX), &["an inference uses every value", "remove it"]);
}

#[test]
fn what_cannot_be_estimated_is_refused_with_names() {
    let data = recording(2000, usize::MAX);
    let reduced = "[infer.reduced]\nstart = { a = 1.0, b = 1.0, e = 1.0, f = 1.0 }\ncoefficients = { k = \"a*b*e*f\" }\n";
    refused(&format!("{STUDY}\n{reduced}"), &data, &["cannot determine 4 unknowns"]);
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
        (functions.replace("[\"x\"]", "[\"yy\"]"), "a function reads states, inputs, outputs and constants"),
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
