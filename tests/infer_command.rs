//! `starlings infer`: the same bytes whoever makes the sums, priors, reduced models, the tables of the results.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod infer_kit;

use std::fmt::Write as _;
use std::fs;

use access_kit::{Started, listening};
use common::{output, starlings};
use infer_kit::{STUDY, folder, infer, recording, refused, said};

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

#[test]
fn a_worker_that_sees_no_file_of_the_coordinator_makes_the_same_bytes() {
    let dir = folder(STUDY, &recording(5000, usize::MAX));
    infer(dir.path(), "local", "2");
    let (study, elsewhere) = (dir.path().join("study.toml"), tempfile::tempdir().unwrap());
    let out = dir.path().join("remote");
    let mut open = listening("infer", &study, &["--out", out.to_str().unwrap()]);
    // Its own folder has a recording of the same name with other rows, which it must not read.
    fs::write(elsewhere.path().join("data.csv"), recording(5000, 0)).unwrap();
    let access = elsewhere.path().join("access.json");
    fs::copy(out.join("access.json"), &access).unwrap();
    let mut call = starlings();
    call.current_dir(elsewhere.path()).args(["worker", "--access", "access.json"]);
    let mut worker = Started::of(&mut call);
    assert_eq!(open.end(), Some(0), "{}", open.said());
    assert_eq!(worker.end(), Some(0), "{}", worker.said());
    for file in ["infer.json", "coefficients.csv", "report.html", "study.toml"] {
        let read = |folder: &str| fs::read(dir.path().join(folder).join(file)).unwrap();
        assert_eq!(read("local"), read("remote"), "{file}");
    }
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
    // The remedy is not a longer recording: errors of half a unit hide steps of a twentieth.
    refused(
        &STUDY.replace("block = 300", "measurement_noise = \"none\""),
        &data,
        &[
            "errors of the measurement hide",
            "`x` (errors of sd 4.",
            "e-1, movement ",
            "`measurement_noise = <sd>`",
        ],
    );
    let dir = folder(&STUDY.replace("block = 300", "measurement_noise = 0.5"), &data);
    let found = infer(dir.path(), "out", "2");
    let of = found["convergence_of"].as_str().unwrap();
    assert!(of.contains("before smoothing"), "{of}");
    let noise = found["diffusion"]["matrix"][0][0].as_f64().unwrap();
    // 2 M/h of the raw residuals is 50, and D is a quarter.
    assert!(noise < 5.0, "{noise}");
    // Without a fit neighbouring differences say how large the errors are.
    assert_eq!(said(&found, "is not what neighbouring rows show"), Vec::<&str>::new());
    let dir = folder(&STUDY.replace("block = 300", "measurement_noise = 0.8"), &data);
    let found = infer(dir.path(), "out", "2");
    assert_eq!(said(&found, "is not what neighbouring rows show in x (0.4").len(), 1, "{found}");
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
