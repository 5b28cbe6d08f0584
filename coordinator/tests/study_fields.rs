//! Studies of models with fields: which columns become channels, where runs start, what is refused.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_coordinator::study::{Problem, Study};
use study_kit::tube::{STARTED, TRUTH, TUBE, blank, columns, flow, start, started, truth};
use study_kit::{Case, csv, grid, normals};

fn problems(study: &str, files: &[(&str, String)]) -> Vec<Problem> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    Study::load(&file).err().map_or_else(Vec::new, |error| error.problems)
}

/// The only problem: `file:line: message; help`, without the folder.
fn problem(study: &str, files: &[(&str, String)]) -> String {
    let found = problems(study, files);
    assert_eq!(found.len(), 1, "{found:?}");
    let p = &found[0];
    let folder = format!("{}/", p.file.parent().unwrap().display());
    let name = p.file.file_name().unwrap().to_string_lossy().into_owned();
    let line = p.line_column().unwrap_or_default().0;
    format!("{name}:{line}: {}; {}", p.message.replace(&folder, ""), p.help.clone().unwrap_or_default())
}

#[test]
fn the_columns_that_exist_are_the_observed_components() {
    let of = truth(Twin::default());
    let some = columns(&of, |c| ["displacement[1]", "displacement[4]", "flow"].contains(&c));
    let study = Case::new(TUBE, &[("wall.csv", some)]).study();
    assert_eq!(study.setup.outputs, ["displacement[1]", "displacement[4]"]);
    let channel = &study.records[0].channels[1];
    assert_eq!((channel.column.as_str(), channel.row, channel.noise), ("displacement[4]", 1, 0.01));
    let at = of.columns.iter().position(|c| c == "displacement[4]").unwrap();
    assert_eq!(channel.values, of.values[at]);
}

#[test]
fn one_component_can_be_measured_by_a_column_of_any_name() {
    let text = columns(&truth(Twin::default()), |c| ["displacement[2]", "flow"].contains(&c));
    let text = text.replace("displacement[2]", "catheter tip");
    let study = TUBE.replace(
        "column = \"displacement\", output = \"displacement\"",
        "column = \"catheter tip\", output = \"displacement[2]\"",
    );
    assert_eq!(Case::new(&study, &[("wall.csv", text)]).study().setup.outputs, ["displacement[2]"]);
}

#[test]
fn a_field_has_one_noise_pooled_over_its_components() {
    let n = 161;
    let (loud, quiet) = (normals(n, 1), normals(n, 2));
    let quiet: Vec<f64> = quiet.iter().map(|v| 0.1 * v).collect();
    let times = grid(n, 0.01);
    let flow: Vec<f64> = times.iter().map(|t| flow(*t)).collect();
    let text = csv("time,flow,displacement[0],displacement[1]", &[&times, &flow, &loud, &quiet]);
    let study = Case::new(&TUBE.replace("noise = 0.01", "noise = \"auto\""), &[("wall.csv", text)]).study();
    let noise: Vec<f64> = study.records[0].channels.iter().map(|c| c.noise).collect();
    // √((1² + 0.1²)/2) = 0.711; a third-difference estimate from 161 samples scatters by about a tenth.
    assert!(noise[0] == noise[1] && (noise[0] - 0.711).abs() < 0.2, "{noise:?}");
    let told: Vec<&String> = study.warnings.iter().filter(|w| w.contains("2 components, pooled")).collect();
    assert_eq!(told.len(), 1, "{:?}", study.warnings);
}

#[test]
fn a_held_out_field_or_component_is_not_fitted() {
    let file = [("wall.csv", blank(161, 0.01, 6))];
    let held_out = |names: &str| {
        let study = format!("{TUBE}[explain]\nhold_out_channels = [{names}]\n");
        let study = Case::new(&study, &file).study();
        study.records[0].channels.iter().map(|c| u8::from(c.held_out)).collect::<Vec<_>>()
    };
    assert_eq!(held_out("\"displacement[3]\""), [0, 0, 0, 1, 0, 0]);
    let all = format!("{TUBE}[explain]\nhold_out_channels = [\"displacement\"]\n");
    assert!(problem(&all, &file).contains("every channel of record `beats` is held out"));
    let seventh = format!("{TUBE}[explain]\nhold_out_channels = [\"displacement[6]\"]\n");
    assert!(problem(&seventh, &file).contains("no channel measures `displacement[6]`"));
}

#[test]
fn columns_that_do_not_fit_a_field_are_refused_with_what_was_looked_for() {
    let file = |names: &str| {
        let times = grid(161, 0.01);
        let flow: Vec<f64> = times.iter().map(|t| flow(*t)).collect();
        [("wall.csv", csv(&format!("time,flow,{names}"), &[&times, &flow, &flow]))]
    };
    assert_eq!(
        problem(TUBE, &file("wall")),
        "study.toml:19: `wall.csv` has none of the columns `displacement[0]` to `displacement[5]` of the 6 components of \
         output `displacement`; its columns are `time`, `flow`, `wall`"
    );
    assert!(problem(TUBE, &file("displacement")).contains("say which, as output = \"displacement[0]\""));
    assert!(
        problem(TUBE, &file("displacement[6]"))
            .contains("has a column `displacement[6]`, but output `displacement` has 6 components")
    );
    let seventh = TUBE.replace("output = \"displacement\"", "output = \"displacement[6]\"");
    assert!(problem(&seventh, &file("displacement")).contains("`displacement[0]` to `displacement[5]`"));
    let twice = TUBE.replace(
        "noise = 0.01 }",
        "noise = 0.01 }, { column = \"flow\", output = \"displacement[0]\", noise = 1 }",
    );
    assert!(problem(&twice, &file("displacement[0]")).contains("output `displacement[0]` has two channels"));
}

#[test]
fn a_run_starts_from_the_file_of_initial_values_but_where_one_is_estimated() {
    let of = truth(Twin::default());
    let files = [("wall.csv", blank(161, 0.01, 6)), ("start.csv", start(&of))];
    let study = Case::new(&started(), &files).study();
    assert_eq!(study.setup.model.constants.len(), of.start.len());
    assert_eq!(study.setup.model.constants["initial:pi"], of.start.last().unwrap().1);
    // Times at their start show the state that was given, to the last bit.
    let values = TRUTH.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let restarted = simulate(&study, &Twin { values, ..Twin::default() }).unwrap();
    assert_eq!(restarted.values, of.values);
    let estimated = started().replace(
        "[[records]]",
        "[[parameters]]\nname = \"initial:pi\"\nprior = { transform = \"log\", median = 1e5, factor = 1.2 }\n[[records]]",
    );
    let study = Case::new(&estimated, &files).study();
    assert!(!study.setup.model.constants.contains_key("initial:pi"));
    assert!(study.setup.model.constants.contains_key("initial:eta[5]"));
}

#[test]
fn initial_values_that_do_not_fit_are_told_at_their_line() {
    let told = |rows: &str| {
        problem(
            &started(),
            &[("wall.csv", blank(161, 0.01, 6)), ("start.csv", format!("state,value\n{rows}\n"))],
        )
    };
    assert_eq!(
        told("pi,1e5\neta,1"),
        "start.csv:3: state `eta` has 6 components; give each its row, `eta[0]` to `eta[5]`"
    );
    assert_eq!(
        told("eta[6],1"),
        "start.csv:2: model `fsi-tube` has no state `eta[6]`; its components are `eta[0]` to `eta[5]`"
    );
    assert_eq!(told("pj,1"), "start.csv:2: model `fsi-tube` has no state `pj`; did you mean `pi`?");
    assert_eq!(told("pi,1\npi,2"), "start.csv:3: `initial:pi` is given twice; remove one of the two values");
    assert!(told("pi,high").contains("`high` in column `value` is not a finite number"));
    let both = started().replace(STARTED, &format!("{STARTED}\nconstants = {{ \"initial:pi\" = 1 }}"));
    let files = [("wall.csv", blank(161, 0.01, 6)), ("start.csv", "state,value\npi,2\n".to_owned())];
    assert!(problem(&both, &files).contains("given twice"));
    let part = [("wall.csv", blank(161, 0.01, 6)), ("start.csv", "state,value\neta[0],0.1\n".to_owned())];
    let study = Case::new(&started(), &part).study();
    assert!(
        study.warnings.iter().any(|w| w.contains("1 of the 6 components of `eta`")),
        "{:?}",
        study.warnings
    );
}

#[test]
fn a_gain_beyond_what_the_recordings_allow_is_refused_with_the_largest_one() {
    let of = truth(Twin::default());
    let file = [("wall.csv", columns(&of, |c| c.starts_with("displacement") || c == "flow"))];
    let with = |gain: f64| format!("{TUBE}[observer]\nkind = \"image-force\"\ngain = {gain}\n");
    assert_eq!(problems(&with(199.0), &file), []);
    let told = problem(&with(201.0), &file);
    assert!(told.starts_with("study.toml:22: a gain of 201 is unstable"), "{told}");
    assert!(told.contains("the largest stable gain is 200.0000 1/s"), "{told}");
}

#[test]
fn a_gain_is_bounded_by_the_largest_time_between_observations_of_an_irregular_record() {
    let of = truth(Twin::default());
    let regular = columns(&of, |c| c.starts_with("displacement") || c == "flow");
    // Without the observations at 0.60 and 0.61 s: 30 ms instead of 10 ms once, and 2/Δt = 66.67.
    let gap = |line: &&str| !["0.6,", "0.61,"].iter().any(|time| line.starts_with(time));
    let irregular: Vec<&str> = regular.lines().filter(gap).collect();
    assert_eq!(irregular.len() + 2, regular.lines().count());
    let file = [("wall.csv", irregular.join("\n"))];
    let with = |gain: f64| format!("{TUBE}[observer]\nkind = \"image-force\"\ngain = {gain}\n");
    assert_eq!(problems(&with(66.0), &file), []);
    let told = problem(&with(67.0), &file);
    assert!(told.contains("record `beats` is observed 0.0300 s apart"), "{told}");
    assert!(told.contains("the largest stable gain is 66.6667 1/s"), "{told}");
}

#[test]
fn a_component_column_of_a_misspelt_index_is_refused_and_an_empty_one_is_told() {
    let text = blank(161, 0.01, 6);
    let misspelt = [("wall.csv", text.replacen("displacement[1]", "displacement[01]", 1))];
    assert_eq!(
        problem(TUBE, &misspelt),
        "study.toml:19: `wall.csv` has a column `displacement[01]`, which is no component of output `displacement`; \
         components are counted from 0: `displacement[0]` to `displacement[5]`"
    );
    // The last column without its zeros.
    let rows: Vec<&str> = text.lines().map(|line| line.strip_suffix("0.0").unwrap_or(line)).collect();
    let study = Case::new(TUBE, &[("wall.csv", rows.join("\n"))]).study();
    let told = "record `beats` has no value in `displacement[5]`: 5 of 6 columns are observed";
    assert_eq!(study.warnings.iter().filter(|w| w.as_str() == told).count(), 1, "{:?}", study.warnings);
    assert_eq!(study.setup.outputs.len(), 5);
}

#[test]
fn a_number_of_a_layout_that_is_not_finite_is_refused_at_its_line() {
    let file = [("wall.csv", blank(161, 0.01, 6))];
    for value in ["inf", "-inf", "nan"] {
        let told = problem(&TUBE.replace("cells = 6", &format!("step = {value}\ncells = 6")), &file);
        assert!(told.starts_with("study.toml:7: "), "{told}");
        assert!(told.contains("`step` in the layout") && told.contains("a finite number"), "{told}");
    }
}

#[test]
fn an_observer_may_not_rest_on_a_held_out_channel() {
    let of = truth(Twin::default());
    let file = [("wall.csv", columns(&of, |_| true))];
    let both = TUBE.replace(
        "noise = 0.01 }",
        "noise = 0.01 }, { column = \"velocity\", output = \"velocity\", noise = 1 }",
    );
    let both = format!("{both}[observer]\nkind = \"dvf\"\ngain = 1.0\n");
    assert_eq!(problems(&both, &file), []);
    let held_out = format!("{both}[explain]\nhold_out_channels = [\"velocity\"]\n");
    let told = problem(&held_out, &file);
    assert!(told.starts_with("study.toml:21: without the channels that are held out"), "{told}");
}

/// Two observers of a tube whose outlet pressure is measured too.
fn side_by_side(first: (&str, f64), second: (&str, f64)) -> String {
    let pressure = "noise = 0.01 }, { column = \"pressure\", output = \"pressure\", noise = 1000 }";
    let of = |(kind, gain): (&str, f64)| format!("[[observer]]\nkind = \"{kind}\"\ngain = {gain}\n");
    TUBE.replace("noise = 0.01 }", pressure) + &of(first) + &of(second)
}

#[test]
fn observers_that_correct_states_of_their_own_go_together_and_two_of_one_state_are_refused() {
    let of = truth(Twin::default());
    let file = [("wall.csv", columns(&of, |_| true))];
    let told = problem(&side_by_side(("sdf", 20.0), ("nudging", 5.0)), &file);
    assert!(told.contains("the observers `sdf` by `displacement` and `nudging` by `displacement` both correct the state `eta[0]`"), "{told}");
    let told = problem(&side_by_side(("sdf", 20.0), ("windkessel", 0.0)), &file);
    assert!(told.contains("an observer of a list has a kind and a gain above zero"), "{told}");
    let done = Case::new(&side_by_side(("sdf", 20.0), ("windkessel", 5.0)), &file).run();
    let observer = done.summary.observer.unwrap();
    assert_eq!(observer.kind, "sdf + windkessel");
    assert!(observer.innovation_rms_with.is_finite());
}
