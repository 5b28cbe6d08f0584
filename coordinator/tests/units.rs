//! Unit labels of whole studies: which contradictions are reported, in which words, and which labels contradict nothing.
// The helpers of a test file are tests too.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;

use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::{RunFolder, Study, StudyError};

fn recording() -> String {
    let mut text = "time,pressure,flow\n".to_owned();
    for i in 0..40 {
        let t = 0.05 * f64::from(i);
        writeln!(text, "{t:.2},{:.3},{:.3}", 90.0 + 20.0 * t.sin(), 50.0 * t.cos()).unwrap();
    }
    text
}

fn load(study: &str) -> Study {
    read(study).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(study: &str) -> String {
    read(study).map(|study| study.name).unwrap_err().to_string()
}

fn read(study: &str) -> Result<Study, StudyError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.csv"), recording()).unwrap();
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    Study::load(&file)
}

/// A Windkessel with these labels of R, C, initial pressure, channel, and time; an empty label is left out.
fn windkessel([r, c, p, channel, time]: [&str; 5]) -> Vec<String> {
    let unit = |label: &str| if label.is_empty() { String::new() } else { format!("unit = \"{label}\"") };
    let comma = if channel.is_empty() { "" } else { "," };
    let time = if time.is_empty() { "s" } else { time };
    load(&format!(
        r#"
[study]
name = "aorta"
time_unit = "{time}"
[model]
kind = "windkessel-2"
[[parameters]]
name = "R"
{}
prior = {{ transform = "log", median = 3.0, factor = 2.0 }}
[[parameters]]
name = "C"
{}
prior = {{ transform = "log", median = 1.0, factor = 2.0 }}
[[parameters]]
name = "initial:p"
{}
prior = {{ transform = "linear", median = 80.0, sd = 10.0 }}
[[records]]
name = "beat"
file = "data.csv"
inputs = {{ flow = "flow" }}
channels = [ {{ column = "pressure", output = "pressure", noise = 2.0 {comma} {} }} ]
"#,
        unit(r),
        unit(c),
        unit(p),
        unit(channel)
    ))
    .warnings
}

/// An oscillator written as equations, with the unit of its stiffness.
fn oscillator(stiffness: &str, more: &str) -> Vec<String> {
    oscillator_study(stiffness, more).warnings
}

fn oscillator_study(stiffness: &str, more: &str) -> Study {
    load(&format!(
        r#"
[study]
name = "spring"
[model]
kind = "equations"
outputs = [ {{ name = "position", unit = "m", value = "x" }} ]
inputs = [ {{ name = "F", unit = "N" }} ]
[[model.states]]
name = "x"
unit = "m"
initial = 0.1
rate = "v"
[[model.states]]
name = "v"
unit = "m/s"
rate = {{ spring = "-k*x/m", viscous = "-c*v/m", drive = "F/m" }}
[[parameters]]
name = "k"
unit = "{stiffness}"
prior = {{ transform = "log", median = 30.0, factor = 1.5 }}
[[parameters]]
name = "c"
unit = "N s/m"
prior = {{ transform = "log", median = 1.5, factor = 2.0 }}
[[parameters]]
name = "m"
unit = "kg"
prior = {{ transform = "log", median = 1.0, factor = 2.0 }}
[[records]]
name = "shaker"
file = "data.csv"
inputs = {{ F = "flow" }}
channels = [ {{ column = "pressure", output = "position", noise = 2.0 }} ]
{more}
"#
    ))
}

#[test]
fn labels_of_one_system_are_not_spoken_of() {
    let none: [&str; 0] = [];
    assert_eq!(windkessel([""; 5]), none);
    assert_eq!(windkessel(["dyn s/cm^5", "cm^5/dyn", "dyn/cm^2", "dyn/cm^2", ""]), none);
    assert_eq!(windkessel(["mmHg·s/mL", "mL mmHg^-1", "mmHg", "", ""]), none, "the model's in other words");
    assert_eq!(windkessel(["kPa s/L", "L/kPa", "kPa", "kPa", "s"]), none);
    assert_eq!(windkessel(["PRU", "", "", "", ""]), none, "what cannot be read is only a label");
    assert_eq!(oscillator("N/m", ""), none);
    assert_eq!(oscillator("kg/s^2", ""), none);
}

#[test]
fn a_label_of_another_dimension_is_told_with_both() {
    assert_eq!(
        windkessel(["mL", "", "", "", ""]),
        ["parameter `R` is given in mL, the model has it in mmHg s/mL: its numbers are taken as they stand."]
    );
    assert_eq!(
        windkessel(["", "", "", "mL/s", ""]),
        [
            "output `pressure` is given in mL/s, the model has it in mmHg: its numbers are taken as they stand."
        ]
    );
}

#[test]
fn the_one_label_that_no_system_joins_with_the_others_is_named() {
    assert_eq!(
        windkessel(["dyn s/cm^5", "mL/mmHg", "mmHg", "", ""]),
        [
            "parameter `R` is given in dyn s/cm^5, which no one system of units joins with the others (parameter `C` in \
          mL/mmHg, parameter `initial:p` in mmHg, output `pressure` in mmHg, time in s): its numbers are taken as they stand."
        ]
    );
    let forgotten = windkessel(["dyn s/cm^5", "cm^5/dyn", "dyn/cm^2", "", ""]);
    assert_eq!(forgotten.len(), 1, "{forgotten:?}");
    assert!(
        forgotten[0]
            .starts_with("output `pressure` has no `unit` in the study and counts in mmHg as in the model"),
        "{forgotten:?}"
    );
    let time = windkessel(["", "", "", "", "ms"]);
    assert_eq!(time.len(), 1, "{time:?}");
    assert!(time[0].starts_with("time is given in ms, which no one system"), "{time:?}");
}

#[test]
fn a_wrong_unit_in_an_equation_is_one_warning() {
    assert_eq!(
        oscillator("N", ""),
        [
            "units: term `spring` of the rate of `v`, `-k*x/m`: it is in m^2/s^2, expected m/s per s; its numbers are taken as \
          they stand."
        ]
    );
}

#[test]
fn a_number_that_makes_an_argument_plain_has_the_unit_that_it_needs() {
    let friction = |term: &str| {
        format!(
            "[[effects]]\nname = \"friction\"\nadds = [ {{ to = \"v\", term = \"{term}\" }} ]\n\
             parameters = [ {{ name = \"mu\", unit = \"m/s^2\" }}, {{ name = \"vs\", unit = \"m/s\", range = [0.1, 1], grid = [0.5] }} ]"
        )
    };
    for term in ["-mu*tanh(v/0.002)*vs/vs", "-mu*tanh(500*v)*exp(-v^2/0.04)*vs/vs", "-mu*tanh(v/vs)"] {
        let study = oscillator_study("N/m", &friction(term));
        assert!(study.warnings.is_empty() && study.candidate_warnings.is_empty(), "{term}: {study:?}");
    }
}

#[test]
fn an_effect_that_takes_no_part_is_warned_of_where_it_is_tried() {
    let effect = "[[effects]]\nname = \"odd\"\nadds = [ { to = \"v\", term = \"-d*tanh(x*F)\" } ]\n\
                  parameters = [ { name = \"d\", unit = \"m/s^2\" } ]";
    let described = oscillator_study("N/m", effect);
    assert_eq!(described.warnings, [""; 0], "a run is without it");
    let [(name, warning)] = &described.candidate_warnings[..] else { panic!("{described:?}") };
    assert!(name == "odd" && warning.contains("the argument of `tanh` is in"), "{warning}");
    let prior = "[[parameters]]\nname = \"d\"\nunit = \"m/s^2\"\nprior = { transform = \"linear\", median = 0, sd = 1 }\n";
    let part = oscillator_study("N/m", &format!("{prior}{effect}"));
    assert_eq!((part.warnings.len(), part.candidate_warnings.len()), (1, 0), "{:?}", part.warnings);
}

#[test]
fn an_equation_holds_in_the_units_that_it_is_written_in() {
    let initial = "[[parameters]]\nname = \"initial:x\"\nunit = \"mm\"\nprior = { transform = \"linear\", mean = 1, sd = 2 }";
    assert_eq!(
        oscillator("N/m", initial),
        ["parameter `initial:x` is given in mm, the model has it in m: its numbers are taken as they stand."]
    );
}

#[test]
fn an_output_that_corrects_a_state_in_another_unit_is_one_warning() {
    let text = |kind: &str, layout: &str, [output, state]: [&str; 2]| {
        format!(
            "[study]\nname = \"a\"\n[model]\nkind = \"{kind}\"\n{layout}\n\
             [[parameters]]\nname = \"p0\"\nprior = {{ transform = \"log\", median = 1e5, factor = 2 }}\n\
             [observer]\nkind = \"nudging\"\ngain = 1.0\ncorrects = {{ {output} = \"{state}\" }}\n\
             [[records]]\nname = \"r\"\nfile = \"data.csv\"\ninputs = {{ flow = \"flow\" }}\n\
             channels = [ {{ column = \"pressure\", output = \"{output}[0]\", noise = 1 }} ]\n"
        )
    };
    let study = |kind: &str, layout: &str, pair| load(&text(kind, layout, pair)).warnings;
    let segment = "layout = { segments = [ { name = \"a\", from = \"i\", to = \"o\", length = 5, radius = 1, thickness = 0.1, \
                   cells = 5 } ], nodes = [ { name = \"i\", kind = \"inlet\" }, { name = \"o\", kind = \"rcr\" } ] }";
    assert_eq!(
        study("artery-1d", segment, ["displacement", "A"]),
        [
            "`corrects`: output `displacement` is in cm, state `A` in cm^2: its innovations are added to the state as they \
          stand; name the state that the output shows, or an output in cm^2."
        ]
    );
    assert_eq!(study("artery-1d", segment, ["flow_rate", "Q"]), [""; 0]);
    assert_eq!(study("fsi-tube", "", ["displacement", "eta"]), [""; 0]);
    // Nothing of a velocity shows in a displacement at the same time: that is more than another unit.
    let told = refused(&text("fsi-tube", "", ["displacement", "w"]));
    assert!(told.contains("does not depend on the state `w"), "{told}");
}

#[test]
fn a_term_of_an_effect_is_compared_be_it_used_or_not() {
    let effect = "[[effects]]\nname = \"stiffening\"\nadds = [ { to = \"v\", term = \"-q*x^3\" } ]\n\
                  parameters = [ { name = \"q\", unit = \"N/m^3\" } ]\n";
    let expected = [
        "units: effect `stiffening`, added to `v`, `-q*x^3`: it is in N, expected m/s per s; its numbers are taken \
                     as they stand.",
    ];
    let described = oscillator_study("N/m", effect).candidate_warnings;
    assert_eq!(described, [("stiffening".to_owned(), expected[0].to_owned())]);
    let used = "[[parameters]]\nname = \"q\"\nprior = { transform = \"log\", median = 1, factor = 2 }\n";
    assert_eq!(oscillator("N/m", &format!("{effect}{used}")), expected);
}

#[test]
fn a_built_in_effect_fits_whatever_system_the_study_uses() {
    let effect = "[[effects]]\nname = \"series-resistance\"\nbuilt_in = \"series-resistance\"\n";
    let study = |unit: &str| {
        format!(
            "[study]\nname = \"a\"\n[model]\nkind = \"windkessel-2\"\nconstants = {{ R = 1850, C = 0.001 }}\n\
             [[parameters]]\nname = \"Rs\"\nunit = \"{unit}\"\nprior = {{ transform = \"log\", median = 1, factor = 2 }}\n\
             [[records]]\nname = \"r\"\nfile = \"data.csv\"\ninputs = {{ flow = \"flow\" }}\n\
             channels = [ {{ column = \"pressure\", output = \"pressure\", unit = \"dyn/cm^2\", noise = 1 }} ]\n{effect}"
        )
    };
    assert_eq!(load(&study("dyn s/cm^5")).warnings, [""; 0]);
    assert_eq!(
        load(&study("dyn/cm^5")).warnings,
        [
            "parameter `Rs` is given in dyn/cm^5, the model has it in mmHg s/mL: its numbers are taken as they stand."
        ]
    );
}

#[test]
fn the_examples_raise_no_warning_about_units() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    for name in ["rcr", "oscillator", "pig-aorta", "pig-aorta-joint"] {
        let study = Study::load(&examples.join(name).join("study.toml")).unwrap();
        assert_eq!(study.warnings, [""; 0], "{name}");
    }
}

#[test]
fn a_channel_keeps_the_label_that_the_study_gives() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let study = Study::load(&examples.join("rcr/study.toml")).unwrap();
    assert_eq!(study.records[0].channels[0].unit.as_deref(), Some("dyn/cm^2"));
    let folder = tempfile::tempdir().unwrap();
    let run = RunFolder::create(Purpose::Run, folder.path(), &study, "run", "now").unwrap();
    let info = run.store.meta("info").unwrap().unwrap();
    assert!(info.contains(r#"["pressure","dyn/cm^2"]"#), "{info}");
}
