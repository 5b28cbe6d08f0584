//! What forecasts of the examples hold: the table of docs/forecast.md about the motor on its stand, and what the README of the simulated motor says.
//!
//! `STARLINGS_WRITE_PAGES=1 cargo test --test forecast_examples` writes the table again.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fmt::Write as _;
use std::path::Path;

use common::{output, repository, starlings};
use serde_json::Value;

/// The forecast of a study's run, with 200 members.
fn forecast(study: &Path, folder: &Path, extra: &[&str]) -> Value {
    let run = folder.join(study.file_stem().unwrap());
    let (code, _, stderr) = output(starlings().arg("run").arg(study).arg("--out").arg(&run));
    assert_eq!(code, 0, "{stderr}");
    let forecast = ["--members", "200", "--json"];
    let (code, stdout, stderr) = output(starlings().arg("forecast").arg(&run).args(forecast).args(extra));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

#[test]
fn the_table_of_the_motor_on_its_stand_is_what_the_command_says() {
    let studies = [
        ("study", "thrust, never fitted"),
        ("burn-out", "thrust, never fitted"),
        ("thrust", "thrust after 4.1 s"),
        ("erosion", "thrust, never fitted"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut table = "| study | held out | errors | held-out values in the 90 % band | with errors of the fit | fitted ones |\n\
        |---|---|---|---|---|---|\n"
        .to_owned();
    for (study, held_out) in studies {
        let file = repository("examples/knsb-motor").join(format!("{study}.toml"));
        let found = forecast(&file, folder.path(), &[]);
        let outputs = found["outputs"].as_array().unwrap();
        let thrust = outputs.iter().find(|o| o["output"] == "thrust").unwrap();
        let share = |part: &str| {
            let share = |o: &Value| o["coverage90"][part].as_f64();
            let of_thrust = share(thrust).or_else(|| outputs.iter().find_map(share));
            100.0 * of_thrust.unwrap()
        };
        let errors = thrust["errors"]["sd"].as_f64().unwrap();
        let (out, fitted) = (share("held_out"), share("train"));
        assert!(out >= 85.0, "{study}: the band holds {out} % of what was held out");
        let by_fit = thrust["coverage90"]["held_out_by_fit"].as_f64();
        let by_fit = by_fit.map_or_else(|| "the same".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        writeln!(
            table,
            "| `{study}.toml` | {held_out} | {errors:.0} N | {out:.1} % | {by_fit} | {fitted:.1} % |"
        )
        .unwrap();
    }
    let page = repository("docs/forecast.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let (begin, end) = ("<!-- table -->\n", "<!-- end of table -->");
    let from = text.find(begin).unwrap() + begin.len();
    let to = text.find(end).unwrap();
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(page, format!("{}{table}{}", &text[..from], &text[to..])).unwrap();
    } else {
        assert_eq!(&text[from..to], table, "write it again as the head of this test says");
    }
}

#[test]
fn the_simulated_motor_bursts_when_its_page_says_and_the_false_alarm_never() {
    let folder = tempfile::tempdir().unwrap();
    let example = repository("examples/rocket-motor");
    let asked = ["--until", "22", "--level", "pressure>1.55", "--horizon", "20"];
    let readme = std::fs::read_to_string(example.join("README.md")).unwrap();
    let readme = readme.split_whitespace().collect::<Vec<_>>().join(" ");
    let says = |words: &str| assert!(readme.contains(words), "the page does not say: {words}");
    let burst = &forecast(&example.join("study.toml"), folder.path(), &asked);
    let level = &burst["levels"][0];
    let [median, lo, hi] =
        [&level["median"], &level["interval90"][0], &level["interval90"][1]].map(|v| v.as_f64().unwrap());
    assert!((median - 17.09).abs() < 0.5, "the case bursts at 17.09 s: {median}");
    assert_eq!(level["probability_by_horizon"], 1.0);
    says(&format!("at {median:.2} s (90 % of 200 members between {lo:.2} and {hi:.2} s)"));
    let held_out = burst["outputs"][0]["coverage90"]["held_out"].as_f64().unwrap();
    says(&format!("holds {:.0} % of the recording after 12 s", 100.0 * held_out));
    let cloud = &forecast(&example.join("false-alarm.toml"), folder.path(), &asked);
    assert_eq!(
        (&cloud["levels"][0]["crossed"], &cloud["levels"][0]["probability"]),
        (&0.into(), &0.0.into())
    );
    says("crossed by none of 200 members up to 22 s");
}

#[test]
fn what_comes_next_of_the_lorenz_system_is_what_its_page_says() {
    let folder = tempfile::tempdir().unwrap();
    let example = repository("examples/lorenz");
    for file in ["study.toml", "truth.toml", "start.csv"] {
        std::fs::copy(example.join(file), folder.path().join(file)).unwrap();
    }
    let made = |arguments: &[&str]| {
        let (code, stdout, stderr) = output(starlings().current_dir(folder.path()).args(arguments));
        assert_eq!(code, 0, "{stderr}");
        stdout
    };
    made(&["simulate", "truth.toml", "--until", "8", "--step", "0.002", "-o", "data.csv"]);
    made(&["infer", "study.toml", "--out", "lorenz-result"]);
    let asked =
        ["forecast", "lorenz-result", "--until", "8.5", "--level", "x1<-20", "--horizon", "8.2", "--json"];
    let found: Value = serde_json::from_str(&made(&asked)).unwrap();
    let level = &found["levels"][0];
    let readme = std::fs::read_to_string(example.join("README.md")).unwrap();
    let readme = readme.split_whitespace().collect::<Vec<_>>().join(" ");
    let [early, late] =
        [&level["probability_by_horizon"], &level["probability"]].map(|p| p.as_f64().unwrap());
    let says = format!("{early:.3} by 8.2 s and {late:.3} by 8.5 s");
    assert!(readme.contains(&says), "the page does not say: {says}");
}
