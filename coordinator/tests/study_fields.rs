//! Studies of models with fields: which columns become channels, where runs start, what is refused, what the summary pools.
// Values that are copied are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::report;
use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use starlings_coordinator::study::{Problem, Study};
use study_kit::{Case, Done, csv, grid, normals};

/// A tube of six cells in two regions over two beats.
const TUBE: &str = r#"
[study]
name = "tube"
[model]
kind = "fsi-tube"
[model.layout]
cells = 6
regions = 2
[[parameters]]
name = "E1"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[parameters]]
name = "E2"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[records]]
name = "beats"
file = "wall.csv"
inputs = { flow = "flow" }
channels = [ { column = "displacement", output = "displacement", noise = 0.01 } ]
"#;

const BEAT: f64 = 0.8;
const TRUTH: [(&str, f64); 2] = [("E1", 3e6), ("E2", 7e6)];

/// A squared sine as long as the ejection, so that the input is smooth enough for coarse times.
fn flow(t: f64) -> f64 {
    let phase = (t / BEAT).fract();
    if phase < 0.4 { 300.0 * (std::f64::consts::PI * phase / 0.4).sin().powi(2) } else { 0.0 }
}

/// Times, flow and a column of zeros for every component: what a truth is simulated on.
fn blank(n: usize, step: f64, components: usize) -> String {
    let times = grid(n, step);
    let flow: Vec<f64> = times.iter().map(|t| flow(*t)).collect();
    let zeros = vec![0.0; n];
    let names: Vec<String> = (0..components).map(|i| format!("displacement[{i}]")).collect();
    let columns: Vec<&[f64]> = [times.as_slice(), flow.as_slice()]
        .into_iter()
        .chain(names.iter().map(|_| zeros.as_slice()))
        .collect();
    csv(&format!("time,flow,{}", names.join(",")), &columns)
}

/// The true tube, from its periodic state on.
fn truth(twin: Twin) -> Recording {
    let values = TRUTH.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let study = Case::new(TUBE, &[("wall.csv", blank(161, 0.01, 6))]).study();
    simulate(&study, &Twin { values, period: Some(BEAT), ..twin }).unwrap()
}

/// A recording as `starlings simulate` writes it, only with these columns.
fn columns(of: &Recording, keep: impl Fn(&str) -> bool) -> String {
    let kept: Vec<usize> = (0..of.columns.len()).filter(|i| keep(&of.columns[*i])).collect();
    let names: Vec<&str> = kept.iter().map(|i| of.columns[*i].as_str()).collect();
    let columns: Vec<&[f64]> =
        std::iter::once(of.times.as_slice()).chain(kept.iter().map(|i| of.values[*i].as_slice())).collect();
    csv(&format!("time,{}", names.join(",")), &columns)
}

fn start(of: &Recording) -> String {
    let rows: Vec<String> = of.start.iter().map(|(state, value)| format!("{state},{value:?}")).collect();
    format!("state,value\n{}\n", rows.join("\n"))
}

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

const STARTED: &str = "kind = \"fsi-tube\"\ninitial = \"start.csv\"";

fn started() -> String {
    TUBE.replace("kind = \"fsi-tube\"", STARTED)
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
    let again = simulate(&study, &Twin { values, ..Twin::default() }).unwrap();
    assert_eq!(again.values, of.values);
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
fn the_periodic_start_of_a_twin_returns_after_every_period() {
    let times = grid(321, 0.01);
    // The recording's flow lasts two beats; the twin goes on for four.
    let of = truth(Twin { times, ..Twin::default() });
    assert!(of.n_period.is_some_and(|n| n < 30), "{:?}", of.n_period);
    for (name, values) in of.columns.iter().zip(&of.values) {
        let size = values.iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        // 1e-10 of its size per period, over three periods; the samples of the periods differ by rounding of their times.
        // At a sample of the input its slope is the one before it, but at the very first, where there is none.
        for (a, b) in values[1..80].iter().zip(&values[241..320]) {
            assert!((a - b).abs() <= 1e-8 * size, "{name}: {a} and {b}");
        }
    }
}

#[test]
fn a_period_that_is_not_the_inputs_is_refused() {
    let study = Case::new(TUBE, &[("wall.csv", blank(161, 0.01, 6))]).study();
    let refused =
        |period| simulate(&study, &Twin { period: Some(period), ..Twin::default() }).unwrap_err().to_string();
    assert!(refused(1.0).contains("it has another period"), "{}", refused(1.0));
    assert!(refused(2.0).contains("before the first period does at 2"), "{}", refused(2.0));
}

#[test]
fn relative_noise_is_that_share_of_the_largest_amplitude_of_the_observed_outputs() {
    let (clean, noisy) = (truth(Twin::default()), truth(Twin { noise_share: 0.1, ..Twin::default() }));
    let sd = |of: &Recording, name: &str| of.noise.iter().find(|(n, _)| n == name).unwrap().1;
    let amplitude = |values: &Vec<f64>| {
        values.iter().fold(f64::MIN, |a, v| a.max(*v)) - values.iter().fold(f64::MAX, |a, v| a.min(*v))
    };
    let largest = clean.values[..6].iter().map(amplitude).fold(0.0, f64::max);
    assert_eq!(sd(&noisy, "displacement"), 0.1 * largest);
    assert_eq!(sd(&noisy, "pressure"), 0.0);
    assert_eq!(sd(&clean, "displacement"), 0.0);
    let spread: f64 = noisy.values[2].iter().zip(&clean.values[2]).map(|(a, b)| (a - b).powi(2)).sum();
    // 161 draws determine a variance to about a ninth.
    assert!(((spread / 161.0).sqrt() / (0.1 * largest) - 1.0).abs() < 0.2, "{spread}");
}

/// A fit of two noisy beats, told the initial state or left with the model's own.
fn fit(study: &str, share: f64, told: bool) -> Done {
    let of = truth(Twin { noise_share: share, seed: 5, ..Twin::default() });
    let wall = columns(&of, |c| c.starts_with("displacement") || c == "flow");
    let study = if told { study.replace("kind = \"fsi-tube\"", STARTED) } else { study.to_owned() };
    let sd = of.noise.iter().find(|(name, _)| name == "displacement").map_or(0.01, |(_, sd)| sd.max(1e-4));
    let study = study.replace("noise = 0.01", &format!("noise = {sd:?}"));
    Case::new(&study, &[("wall.csv", wall), ("start.csv", start(&of))]).run()
}

#[test]
fn a_field_is_one_entry_of_the_summary_and_data_ten_steps_apart_determine_the_stiffness() {
    // The tube steps by 1 ms, the recording by 10 ms.
    let done = fit(TUBE, 0.1, true);
    let names: Vec<&str> = done.summary.fit.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["displacement"]);
    assert_eq!(done.summary.fit.records[0].channels.len(), 1);
    let rows = done.table("predictions", "observed, predicted");
    let value = |row: &Vec<String>, i: usize| row[i].parse::<f64>().unwrap();
    let squares: f64 = rows.iter().map(|r| (value(r, 0) - value(r, 1)).powi(2)).sum();
    let rmse = (squares / rows.len() as f64).sqrt();
    let told = done.summary.fit.channels[0].train_rmse.unwrap();
    // The same sum in another order.
    assert!((told / rmse - 1.0).abs() < 1e-12, "{told} {rmse}");
    for (name, truth) in TRUTH {
        let p = done.estimate(name);
        // Four standard deviations: an interval that misses the truth by more is wrong, not unlucky.
        assert!(
            (p.estimate - truth).abs() < 4.0 * p.sd && p.sd < 0.1 * truth,
            "{name}: {} ± {}",
            p.estimate,
            p.sd
        );
    }
    assert!(done.summary.observer.is_none());
}

#[test]
fn the_summary_says_what_the_observer_does_for_a_state_that_starts_wrong() {
    let observer = "[observer]\nkind = \"nudging\"\ngain = 50.0\n";
    let tube =
        TUBE.replace("kind = \"fsi-tube\"", "kind = \"fsi-tube\"\nconstants = { \"initial:pi\" = 5e4 }");
    let wrong = fit(&format!("{tube}{observer}"), 0.02, false);
    let found = wrong.summary.observer.clone().unwrap();
    assert_eq!((found.kind.as_str(), found.gain), ("nudging", 50.0));
    assert!(
        found.innovation_rms_with < 0.8 * found.innovation_rms_without,
        "the observer holds the state: {found:?}"
    );
    let runs = wrong.table("jobs", "pass, step").into_iter().filter(|row| row[0] == "0").count();
    assert_eq!(runs, 2, "the free run and the one with the observer");
    report::write_page(&wrong.folder).unwrap();
    let page = std::fs::read_to_string(wrong.folder.path.join("report.html")).unwrap();
    assert!(page.contains("id=\"observer\"") && page.contains("With the observer nudging"));
    assert!(page.contains("displacement, record beats: residuals by component"));
    // First, middle and last component, and no other.
    let shown =
        |i: usize| page.contains(&format!("displacement[{i}], record beats: predicted against measured"));
    assert_eq!([0, 1, 2, 3, 4, 5].map(shown), [true, false, false, true, false, true]);
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
