//! `starlings spectrum`: tables, JSON, CSV and page of a study, and what it refuses.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test
#![allow(clippy::float_cmp)] // values that pass through unchanged

mod common;

use common::{output, repository, starlings};
use serde_json::Value;

const TOY: &str = "examples/toy-fsi/study.toml";
const WINDKESSEL: &str = "examples/toy-fsi-windkessel/study.toml";

fn spectrum(study: &str, arguments: &[&str]) -> (i32, String, String) {
    output(starlings().arg("spectrum").arg(repository(study)).args(arguments))
}

fn json(study: &str, arguments: &[&str]) -> Value {
    let (code, stdout, stderr) = spectrum(study, &[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{e}: {stdout}"))
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn observer<'a>(found: &'a Value, name: &str) -> &'a Value {
    found["observers"].as_array().unwrap().iter().find(|o| o["name"] == name).unwrap()
}

#[test]
fn the_json_holds_poles_slopes_best_gains_and_the_gain_for_a_decay() {
    let found = json(TOY, &["--observers", "sdf,dvf", "--gains", "0,50,1000", "--decay", "10/0.1"]);
    let poles: Vec<Vec<f64>> = found["poles"].as_array().unwrap().iter().map(numbers).collect();
    assert_eq!(poles.len(), 80);
    // Frequencies of the modes, printed to ten digits; a real part of rounding.
    for (pair, omega) in poles.chunks(2).zip([301.110_657_51, 582.062_647_96, 836.798_907_92]) {
        assert!((pair[0][1] + omega).abs() < 1e-7 && (pair[1][1] - omega).abs() < 1e-7, "{pair:?}");
        assert!(pair[0][0].abs() < 1e-8, "{pair:?}");
    }
    let (sdf, dvf) = (observer(&found, "sdf"), observer(&found, "dvf"));
    for (o, rates, slope) in
        [(sdf, [0.0, -25.0, -100.835_41], -0.5), (dvf, [0.0, -0.366_47, -7.329_38], -7.329_375_081e-3)]
    {
        assert_eq!(numbers(&o["gain"]), [0.0, 50.0, 1000.0]);
        for (rate, expected) in numbers(&o["max_re"]).iter().zip(rates) {
            // Printed to five decimals.
            assert!((rate - expected).abs() < 6e-6, "{rate} {expected}");
        }
        assert_eq!(numbers(&o["slope"]).len(), 80);
        assert!((numbers(&o["slope"])[0] - slope).abs() < 1e-9, "{}", o["slope"][0]);
        assert!((numbers(&o["slope_numerical"])[1] - slope).abs() < 1e-8, "{}", o["slope_numerical"][1]);
    }
    // Critical damping of the first mode; a decay to 10 % in 0.1 s is −ln 10/0.1 = −23.03, reached at half that slope.
    assert!((sdf["best"]["gain"].as_f64().unwrap() - 602.221_315).abs() < 1e-2, "{}", sdf["best"]);
    assert!((sdf["best"]["max_re"].as_f64().unwrap() + 301.11).abs() < 0.1, "{}", sdf["best"]);
    assert!((sdf["gain_for_decay"].as_f64().unwrap() - 46.051_701_86).abs() < 1e-5);
    assert!((found["wanted_max_re"].as_f64().unwrap() + 23.025_850_93).abs() < 1e-8);
}

#[test]
fn the_section_of_the_study_is_the_default() {
    let found = json(TOY, &["--poles", "2"]);
    let names: Vec<&str> =
        found["observers"].as_array().unwrap().iter().map(|o| o["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["dvf", "sdf-displacement", "sdf", "dvf-am"]);
    assert_eq!(numbers(&observer(&found, "dvf")["gain"])[..3], [0.0, 50.0, 100.0]);
    assert_eq!(found["poles"].as_array().unwrap().len(), 2);
    assert!(observer(&found, "dvf-am")["gain_for_decay"].is_number());
}

#[test]
fn a_decay_that_no_gain_reaches_is_null_and_the_best_gain_says_so() {
    let found = json(WINDKESSEL, &["--observers", "dvf,sdf", "--gains", "100", "--decay", "10/0.1"]);
    let dvf = observer(&found, "dvf");
    assert_eq!(dvf["gain_for_decay"], Value::Null);
    assert_eq!(dvf["best"]["beyond"], "no gain helps");
    let sdf = observer(&found, "sdf");
    assert_eq!(sdf["gain_for_decay"], Value::Null, "saturated below 23");
    assert!((numbers(&sdf["max_re"])[0] + 3.656_797).abs() < 6e-7, "{}", sdf["max_re"]);
}

#[test]
fn people_get_tables_and_files_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let (csv, html) = (folder.path().join("poles.csv"), folder.path().join("locus.html"));
    let arguments = ["--observers", "sdf,windkessel", "--gains", "0,100", "--poles", "3", "--csv"];
    let arguments = [&arguments[..], &[csv.to_str().unwrap(), "--html", html.to_str().unwrap()]].concat();
    let (code, stdout, stderr) = spectrum(WINDKESSEL, &arguments);
    assert_eq!(code, 0, "{stderr}");
    for part in ["-0.50984", "-0.057042", "-3.6568", "best gain", "max Re λ"] {
        assert!(stdout.contains(part), "{part} in {stdout}");
    }
    let rows = std::fs::read_to_string(csv).unwrap();
    assert!(rows.starts_with("observer,gain,max_re,pole,re,im\n"), "{rows}");
    // Two observers, two gains, three poles.
    assert_eq!(rows.lines().count(), 1 + 2 * 2 * 3);
    let page = std::fs::read_to_string(html).unwrap();
    assert_eq!(page.matches("role=\"img\" aria-label=").count(), 2);
    assert!(!page.contains(">NaN") && !page.contains("\"NaN"));
}

#[test]
fn observers_that_the_model_cannot_host_are_listed_with_the_reason() {
    let found = json("examples/rcr/study.toml", &["--gains", "1"]);
    let names: Vec<&Value> = found["observers"].as_array().unwrap().iter().map(|o| &o["name"]).collect();
    assert_eq!(names, ["nudging"]);
    let refused = found["refused"].as_array().unwrap();
    let sdf = refused.iter().find(|r| r["name"] == "sdf").unwrap();
    assert!(sdf["reason"].as_str().unwrap().contains("models that can host it"), "{sdf}");
}

/// Each output shows three times as much of the state that the other corrects: an error of opposite signs grows.
const UNSTABLE: &str = r#"
[study]
name = "pair"
[model]
kind = "equations"
outputs = [ { name = "y1", value = "p1 + 3*p2" }, { name = "y2", value = "3*p1 + p2" } ]
[[model.states]]
name = "p1"
initial = 70.0
rate = "-(p1 - p2)/R1"
[[model.states]]
name = "p2"
initial = 68.0
rate = "2*((p1 - p2)/R1 - p2)"
[[parameters]]
name = "R1"
prior = { transform = "log", median = 0.3, factor = 1.5 }
[[observer]]
kind = "nudging"
gain = 20.0
corrects = { y1 = "p1" }
[[observer]]
kind = "nudging"
gain = 12.0
corrects = { y2 = "p2" }
[[records]]
name = "one"
file = "pair.csv"
channels = [ { column = "y1", output = "y1", noise = 1.0 }, { column = "y2", output = "y2", noise = 1.0 } ]
"#;

#[test]
fn a_pair_that_is_unstable_together_is_shown_with_the_factor_that_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("study.toml");
    std::fs::write(&file, UNSTABLE).unwrap();
    std::fs::write(folder.path().join("pair.csv"), "time,y1,y2\n0,270,280\n0.01,270,280\n0.02,270,280\n")
        .unwrap();
    let (code, stdout, stderr) = output(starlings().arg("spectrum").arg(&file));
    assert_eq!(code, 0, "{stderr}");
    for part in
        ["nudging of y1 + nudging of y2", "unstable at the gains of the study (20.000, 12.000", "is 0.3908"]
    {
        assert!(stdout.contains(part), "{part} in {stdout}");
    }
    let (code, stdout, _) = output(starlings().arg("spectrum").arg(&file).arg("--json"));
    assert_eq!(code, 0);
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let names: Vec<&Value> = found["observers"].as_array().unwrap().iter().map(|o| &o["name"]).collect();
    assert_eq!(names, ["nudging of y1 + nudging of y2", "nudging of y1", "nudging of y2"]);
    // The determinant of A − f Γ, 6.667 + 733.3 f − 1920 f², is zero there.
    let share = found["stable_share"].as_f64().unwrap();
    let exact = (2200.0 + (2200.0_f64.powi(2) + 4.0 * 5760.0 * 20.0).sqrt()) / (2.0 * 5760.0);
    assert!((share - exact).abs() < 1e-7, "{share} {exact}");
    let (code, _, stderr) = output(starlings().arg("check").arg(&file));
    assert_eq!(code, 2, "a run of it is refused: {stderr}");
}

#[test]
fn the_share_that_is_stable_is_the_largest_also_where_the_model_alone_grows() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("study.toml");
    std::fs::write(&file, UNSTABLE.replace("/R1 - p2)\"", "/R1 + 0.5*p2)\"")).unwrap();
    std::fs::write(folder.path().join("pair.csv"), "time,y1,y2\n0,270,280\n0.01,270,280\n0.02,270,280\n")
        .unwrap();
    let asked = ["--observers", "nudging of y1"];
    let (code, stdout, stderr) = output(starlings().arg("spectrum").arg(&file).arg("--json").args(asked));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(found["observers"][0]["name"], "nudging of y1");
    // The determinant of A − f Γ, −10/3 + 2020/3 f − 1920 f², is above zero between its zeros, 0.005 and this one.
    let exact = (2020.0 + (2020.0_f64.powi(2) - 4.0 * 5760.0 * 10.0).sqrt()) / (2.0 * 5760.0);
    let share = found["stable_share"].as_f64().unwrap();
    assert!((share - exact).abs() < 1e-7, "{share} {exact}");
}

#[test]
fn wrong_options_are_refused_with_the_remedy() {
    for (arguments, expected) in [
        (["--observers", "sfd"], "did you mean `sdf`?"),
        (["--gains", "-5"], "zero or above"),
        (["--gains", "1,inf"], "finite"),
        (["--gains", "1,1e308"], "the gain 1e308 is too large: the model's own rates are lost"),
        (["--gains", "1,1e308"], "no pole can be found; give gains below "),
        (["--decay", "0.5/1"], "a factor above 1"),
        (["--decay", "10"], "FACTOR/TIME"),
        (["--observers", "windkessel"], "models that can host it"),
    ] {
        let (code, stdout, stderr) = spectrum(TOY, &arguments);
        assert_eq!(code, 2, "{arguments:?}: {stderr}");
        assert!(stderr.replace("\n│ ", " ").contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stdout, "");
    }
}

#[test]
fn a_wrong_section_of_the_study_is_refused_at_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let example = repository("examples/toy-fsi");
    std::fs::copy(example.join("uniform.csv"), folder.path().join("uniform.csv")).unwrap();
    let text = std::fs::read_to_string(example.join("study.toml")).unwrap();
    let (text, _) = text.split_once("[spectrum]").unwrap();
    for (section, expected) in [
        ("observers = [\"dfv\"]", "did you mean `dvf`?"),
        ("gains = [-1.0]", "must not be negative"),
        ("decay = { factor = 1.0, time = 0.1 }", "a factor above 1"),
        ("decay = { factor = 10.0 }", "needs `time`"),
        ("gain = [1.0]", "unknown key `gain`"),
    ] {
        let file = folder.path().join("study.toml");
        std::fs::write(&file, format!("{text}[spectrum]\n{section}\n")).unwrap();
        let (code, _, stderr) = output(starlings().arg("spectrum").arg(&file));
        assert_eq!(code, 2, "{section}: {stderr}");
        assert!(stderr.contains(expected), "{section}: {stderr}");
        assert!(stderr.contains(section.split(' ').next().unwrap()), "the place: {stderr}");
    }
}
