//! `starlings forecast`: bands that are known in closed form, the same bytes whoever computes, levels, and what is refused.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod swing_kit;

use std::fmt::Write;
use std::path::Path;

use common::{bytes, output, run, starlings};
use nalgebra::{Matrix2, Vector2};
use serde_json::Value;
use swing_kit::{NOISE, STUDY, errors, motion, recording};

/// Position after a time from unit displacement and unit velocity.
fn position(t: f64) -> Vector2<f64> {
    motion(t).row(0).transpose()
}

/// Mean and covariance of the start after the rows up to 2 s.
fn posterior() -> (Vector2<f64>, Matrix2<f64>) {
    let prior = Matrix2::new(1.0, 0.0, 0.0, 1.0 / 9.0);
    let (mut precision, mut weighted) = (prior, prior * Vector2::new(0.5, 0.0));
    for (t, y) in recording().into_iter().filter(|(t, _)| *t < 2.0 + 1e-9) {
        let phi = position(t);
        precision += phi * phi.transpose() / (NOISE * NOISE);
        weighted += phi * (y / (NOISE * NOISE));
    }
    let covariance = precision.try_inverse().unwrap();
    (covariance * weighted, covariance)
}

/// A folder with the study, its recording and a finished run.
fn finished(folder: &Path) {
    std::fs::write(folder.join("free.toml"), STUDY).unwrap();
    swing_kit::write(folder);
    run(&folder.join("free.toml"), &folder.join("run"), 2);
}

fn forecast(folder: &Path, extra: &[&str]) -> (i32, String, String) {
    output(starlings().arg("forecast").arg(folder.join("run")).args(extra))
}

#[test]
fn the_fan_of_a_linear_oscillator_is_its_posterior_predictive_band() {
    let folder = tempfile::tempdir().unwrap();
    finished(folder.path());
    let asked = ["--members", "2000", "--until", "5", "--level", "position>0.3", "--json"];
    let (code, stdout, stderr) = forecast(folder.path(), &[&asked[..], &["--workers", "2"]].concat());
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert!(
        found["outputs"][0]["coverage90"]["held_out"].as_f64().is_some_and(|share| share > 0.5),
        "{found}"
    );
    let (mean, covariance) = posterior();
    // The residuals are as large as the noise, so that the members' spread is that of the posterior within the tolerance below.
    let wider = found["wider_given_residuals"].as_f64().unwrap();
    assert!((1.0..1.2).contains(&wider), "{wider}");
    let fitted = recording().into_iter().filter(|(t, _)| *t < 2.0 + 1e-9);
    let squares: Vec<f64> = fitted.map(|(t, y)| (y - position(t).dot(&mean)).powi(2)).collect();
    let residual = (squares.iter().sum::<f64>() / (squares.len() as f64 - 2.0)).sqrt();
    let sd = found["outputs"][0]["errors"]["sd"].as_f64().unwrap();
    assert!((sd - residual.max(NOISE)).abs() < 1e-3, "{sd}, {residual}");
    let text = String::from_utf8(bytes(&folder.path().join("run/forecast"), "fan.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let mut seen = 0;
    for row in rows.records() {
        let row = row.unwrap();
        let value = |i: usize| row[i].parse::<f64>().unwrap();
        let phi = position(value(2));
        let own = (phi.transpose() * covariance * phi)[(0, 0)];
        let variance = if &row[1] == "measured" { own + sd * sd } else { own };
        // 2.5, 5, 25, 50, 75, 95 and 97.5 % of a Gaussian; the sample quantile of 5 % of 2000 has an sd of 0.047 of its sd.
        let normal = [-1.960, -1.645, -1.2816, -0.6745, 0.0, 0.6745, 1.2816, 1.645, 1.960];
        for (k, z) in normal.iter().enumerate() {
            let off = (value(3 + k) - phi.dot(&mean)) / variance.sqrt() - z;
            assert!(off.abs() < 0.3, "{row:?}: {off}");
        }
        seen += 1;
    }
    // Both kinds at the record's 31 times and the 20 after them.
    assert_eq!(seen, 2 * 51);
    assert!((found["outputs"][0]["at_end"][0].as_f64().unwrap() - position(5.0).dot(&mean)).abs() < 0.05);
    let first = ["forecast.json", "fan.csv", "crossing-times.csv", "report.html"]
        .map(|name| bytes(&folder.path().join("run/forecast"), name));
    let (code, _, stderr) = forecast(folder.path(), &[&asked[..], &["--workers", "1"]].concat());
    assert_eq!(code, 0, "{stderr}");
    let again = ["forecast.json", "fan.csv", "crossing-times.csv", "report.html"]
        .map(|name| bytes(&folder.path().join("run/forecast"), name));
    assert!(first == again, "one worker and two give the same bytes");
}

#[test]
fn the_report_of_the_run_has_the_same_band_to_first_order_which_is_exact_here() {
    let folder = tempfile::tempdir().unwrap();
    finished(folder.path());
    let db = rusqlite::Connection::open(folder.path().join("run/run.db")).unwrap();
    let meta = |key: &str| -> Value {
        let text: String =
            db.query_row("SELECT value FROM meta WHERE key = ?1", [key], |row| row.get(0)).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let given = meta("covariance_given_residuals");
    let given = Matrix2::from_fn(|i, j| given[i][j].as_f64().unwrap());
    let sd = meta("prediction_sd");
    let rows = recording();
    assert_eq!(sd.as_array().unwrap().len(), rows.len(), "held-out values have one too");
    for ((t, _), sd) in rows.iter().zip(sd.as_array().unwrap()) {
        let phi = position(*t);
        let expected = (phi.transpose() * given * phi)[(0, 0)].sqrt();
        // The integrator's tolerance over a tenth of a posterior sd, and seven digits.
        assert!((sd.as_f64().unwrap() - expected).abs() < 1e-4 * expected, "{t}: {sd} for {expected}");
    }
    let page = String::from_utf8(bytes(&folder.path().join("run"), "report.html")).unwrap();
    assert!(page.contains("of parameters and noise"), "the report shows it");
}

#[test]
fn members_reach_the_end_and_the_horizon_that_were_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    finished(folder.path());
    // Neither is a whole number of steps after the record's end at 3.
    let asked = ["--until", "3.37", "--horizon", "3.24", "--members", "20", "--level", "position>100"];
    let (code, _, stderr) = forecast(folder.path(), &asked);
    assert_eq!(code, 0, "{stderr}");
    let text = String::from_utf8(bytes(&folder.path().join("run/forecast"), "fan.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let times: Vec<f64> = rows.records().map(|row| row.unwrap()[2].parse().unwrap()).collect();
    assert!(times.contains(&3.37) && times.contains(&3.24), "{times:?}");
    assert!(times.iter().all(|t| *t <= 3.37), "{times:?}");
}

#[test]
fn levels_and_mistakes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    finished(folder.path());
    let with = |members: &str, extra: &[&str]| {
        forecast(folder.path(), &[&["--members", members, "--workers", "1"][..], extra].concat())
    };
    let few = |extra: &[&str]| with("8", extra);
    let (code, stdout, stderr) = few(&["--level", "position>1000", "--until", "4"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("position > 1000: not crossed by any of 8 members up to 4"), "{stdout}");
    let told = [
        (&["--level", "positon>1"][..], "did you mean `position`?"),
        (&["--level", "position"], "expected OUTPUT>VALUE"),
        (&["--level", "position>high"], "`high` is not a number"),
        (&["--until", "-1"], "after the start at"),
        (&["--horizon", "9"], "--horizon 9"),
        (&["--set", "kk=2"], "no parameter, constant or initial value"),
        (&["--record", "fall"], "the study has: swing"),
    ];
    for (extra, message) in told {
        let (code, _, stderr) = few(extra);
        assert_eq!(code, 2, "{extra:?}: {stderr}");
        assert!(stderr.contains(message), "{extra:?}: {stderr}");
    }
    let (code, _, stderr) = with("0", &[]);
    assert!(code == 2 && stderr.contains("give at least one member"), "{stderr}");
    let (code, _, stderr) = output(starlings().arg("forecast").arg(folder.path()));
    assert_eq!(code, 2, "{stderr}");
    std::fs::rename(folder.path().join("free.toml"), folder.path().join("moved.toml")).unwrap();
    let (code, _, stderr) = few(&[]);
    assert!(code == 2 && stderr.contains("--study FILE"), "{stderr}");
    let moved = folder.path().join("moved.toml");
    let (code, _, stderr) = few(&["--study", moved.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
}

/// Shares of values in the 90 % band of what would be measured, fitted and held out, over so many twins with errors of `sd`.
fn coverage(n_twin: u64, sd: f64, correlation: f64) -> [f64; 2] {
    let mut shares = [0.0; 2];
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("free.toml"),
        STUDY.replace("train = [0.0, 2.0]", "train = [0.0, 4.0]"),
    )
    .unwrap();
    for seed in 0..n_twin {
        let mut csv = "time,position\n".to_owned();
        for (i, error) in errors(seed, correlation, 121).into_iter().enumerate() {
            let t = 0.05 * i as f64;
            writeln!(csv, "{t},{}", position(t).x + sd * error).unwrap();
        }
        std::fs::write(folder.path().join("swing.csv"), csv).unwrap();
        let out = folder.path().join(format!("run-{seed}"));
        run(&folder.path().join("free.toml"), &out, 1);
        let asked = ["--members", "400", "--workers", "1", "--json"];
        let (code, stdout, stderr) = output(starlings().arg("forecast").arg(&out).args(asked));
        assert_eq!(code, 0, "{stderr}");
        let found: Value = serde_json::from_str(&stdout).unwrap();
        for (sum, part) in shares.iter_mut().zip(["train", "held_out"]) {
            *sum += found["outputs"][0]["coverage90"][part].as_f64().unwrap() / n_twin as f64;
        }
    }
    shares
}

#[test]
fn the_band_of_what_would_be_measured_holds_nine_values_in_ten_of_twins_with_white_noise() {
    // 24 twins of 40 held-out values: a share's standard error is 0.01.
    let shares = coverage(24, NOISE, 0.0);
    assert!(shares.iter().all(|share| (0.85..=0.95).contains(share)), "{shares:?}");
}

#[test]
fn the_band_of_what_would_be_measured_holds_where_errors_are_larger_than_stated_and_correlated() {
    // Two and a half times the stated noise, correlated by 0.8 from one value to the next: the band of the stated noise would
    // hold half of them. 24 twins of 40 values that count for about 5: a standard error of 0.03.
    let shares = coverage(24, 2.5 * NOISE, 0.8);
    assert!(shares.iter().all(|share| (0.8..=0.97).contains(share)), "{shares:?}");
}
