//! What a solver lacks: effects on its inputs and outputs, and on the rates that it hosts.

use starlings_coordinator::explain::{
    Context, Explanation, Findings, Options, Verdict, explain, explained_study,
};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::store::Store;

use crate::inside::{Inside, Place, no_host, threads};
use crate::messages;
use crate::swing::{native, recording, solver};

/// The explanation of a recording by a solver that takes terms on these states.
fn explained(data: &str, hosts: &[&str]) -> Explanation {
    let (found, ..) = findings(data, hosts, &solver(""));
    assert!(
        found.explanation.warnings.iter().any(|w| w.contains("unknown input")),
        "{:?}",
        found.explanation.warnings
    );
    found.explanation
}

fn findings(data: &str, hosts: &[&str], text: &str) -> (Findings, Place, Inside) {
    let here = Place::new(&[("study.toml", &native("")), ("swing.csv", data)]);
    let there = Place::new(&[("study.toml", text), ("swing.csv", data)]);
    let inside = Inside::of(&here.load(&no_host()).unwrap(), hosts);
    std::fs::create_dir(there.folder.path().join("out")).unwrap();
    let study = there.load(&inside.solver_host()).unwrap();
    let store = Store::create(&there.folder.path().join("out/run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let found = explain(&study, &mut threads(&inside), &store, &mut context, &Options::default());
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    (found, there, inside)
}

fn assert_named(found: &Explanation, name: &str, amplitude: f64) {
    assert_eq!(found.verdict, Verdict::Named, "{}: {:#?}", found.headline, found.tied_with);
    assert_eq!(found.effects[0].name, name, "{}", found.headline);
    let first = &found.effects[0].parameters[0];
    // Five posterior sd: one draw of the noise.
    assert!((first.estimate - amplitude).abs() < 5.0 * first.sd, "{first:?}");
}

#[test]
fn an_offset_of_a_sensor_is_named_though_no_rate_is_open() {
    let found = explained(&recording(&[("sensor-offset:velocity", 0.15)], &[], 11), &[]);
    assert_named(&found, "sensor-offset:velocity", 0.15);
    let refused = found.rejected.iter().find(|r| r.name == "cubic-stiffness").unwrap();
    assert!(refused.reason.contains("the solver `swing` does not host"), "{refused:?}");
}

#[test]
fn an_input_that_is_recorded_too_small_is_named() {
    let found = explained(&recording(&[("input-gain", 0.2)], &[], 12), &[]);
    assert_named(&found, "input-gain", 0.2);
}

#[test]
fn a_term_that_the_solver_hosts_is_named() {
    let found = explained(&recording(&[("cubic-stiffness", 2.0)], &[], 13), &["v"]);
    assert_named(&found, "cubic-stiffness", 2.0);
}

#[test]
fn the_explained_study_finds_the_solver_from_the_folder_that_it_stands_in() {
    let data = recording(&[("sensor-offset:velocity", 0.15)], &[], 11);
    let (found, there, inside) = findings(&data, &[], &solver(""));
    let text = found.explained_study.unwrap();
    let out = there.folder.path().join("out");
    let file = out.join("explained.toml");
    std::fs::write(&file, &text).unwrap();
    let explained =
        Study::load_with(&file, &inside.solver_host()).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let solver = explained.setup.model.solver.unwrap();
    assert_eq!(solver.folder, there.folder.path().canonicalize().unwrap().display().to_string());
    assert_eq!(explained.setup.effects.len(), 1);
}

#[test]
fn the_files_of_a_program_are_found_from_another_folder() {
    let place = messages::place(&messages::command());
    let study = place.load(&no_host()).unwrap();
    let out = place.folder.path().join("runs/one");
    std::fs::create_dir_all(&out).unwrap();
    let text = explained_study(&study, &[], &[], &out).unwrap_or_else(|error| panic!("{error}"));
    let moved = Study::from_text_with(&out.join("explained.toml"), &text, &no_host()).unwrap();
    let (before, after) = (study.setup.model.solver.unwrap(), moved.setup.model.solver.unwrap());
    let (before, after) = (before.files.unwrap(), after.files.unwrap());
    assert_eq!(after.templates, before.templates);
    let real = |path: &String| std::fs::canonicalize(path).unwrap();
    assert_eq!(real(&after.copies["mesh.inp"]), real(&before.copies["mesh.inp"]));
}
