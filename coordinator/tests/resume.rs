//! What an interrupted run may be continued with, and what a start leaves that was killed.

#![allow(clippy::unwrap_used, missing_docs)] // a failed unwrap is a failed test

mod study_kit;

use std::path::Path;

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::store::folder::Call;
use starlings_coordinator::study::{FolderError, RunContext, RunFolder, Study, Summary, run::run};
use study_kit::fleets::Mortal;
use study_kit::{Case, linear};

fn line() -> Case {
    with(&linear::study("passes = 2"))
}

fn with(study: &str) -> Case {
    let (times, z) = linear::data(12, 8);
    Case::new(study, &[("line.csv", linear::file(&times, &z))])
}

/// A run that ended after a few analyses.
fn interrupted(case: &Case) -> std::path::PathBuf {
    let path = case.fresh();
    assert!(case.go(&path, &mut Mortal::new(5)).is_err());
    path
}

fn refused(path: &Path, study: &Study) -> FolderError {
    RunFolder::resume(Purpose::Run, path, study, &Call::default()).err().expect("it is refused")
}

fn change(path: &Path, sql: &str) {
    let database = rusqlite::Connection::open(path.join("run.db")).unwrap();
    assert_eq!(database.execute(sql, []).unwrap(), 1, "{sql}");
}

fn finish(mut folder: RunFolder, study: &Study) -> Summary {
    let mut context =
        RunContext { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 1 };
    run(study, &mut InProcess::new(1), &mut folder, &mut context).unwrap()
}

#[test]
fn another_version_is_refused_and_told() {
    let case = line();
    let path = interrupted(&case);
    change(&path, "UPDATE meta SET value = json_set(value, '$.version', '0.0.7') WHERE key = 'program'");
    for other_build in [false, true] {
        let call = Call { other_build, ..Call::default() };
        let error = RunFolder::resume(Purpose::Run, &path, &case.study(), &call).err().unwrap().to_string();
        let this = env!("CARGO_PKG_VERSION");
        let words =
            format!("was begun by starlings 0.0.7, this is {this}: another version may give other estimates");
        assert!(error.contains(&words), "{error}");
        assert!(error.ends_with("or start a new run instead of --resume"), "{error}");
    }
}

#[test]
fn another_build_goes_on_only_when_that_is_asked_for_and_the_result_says_so() {
    let case = line();
    let whole = case.run();
    let path = interrupted(&case);
    change(
        &path,
        "UPDATE meta SET value = json_set(value, '$.build', 'abcdef0123456789') WHERE key = 'program'",
    );
    let study = case.study();
    let error = refused(&path, &study).to_string();
    for words in [
        "begun by another build of starlings",
        "(abcdef012345; this is ",
        "--resume --other-build: what is stored stays",
    ] {
        assert!(error.contains(words), "`{words}` is missing: {error}");
    }
    let call = Call { other_build: true, ..Call::default() };
    let folder = RunFolder::resume(Purpose::Run, &path, &study, &call).unwrap();
    let summary = finish(folder, &study);
    let warned = summary.warnings.iter().any(|w| w.contains("begun by build abcdef012345 of this program"));
    assert!(warned, "{:?}", summary.warnings);
    // It is this build's from now on, and remains a mixture.
    assert_eq!(RunFolder::open(&path).unwrap().summary().unwrap().unwrap().warnings, summary.warnings);
    assert!(whole.summary.warnings.iter().all(|w| !w.contains("--other-build")));
}

#[test]
fn a_finished_run_is_shown_by_any_build() {
    let case = line();
    let path = case.run().folder.path.clone();
    change(
        &path,
        "UPDATE meta SET value = json_set(value, '$.build', 'abcdef0123456789') WHERE key = 'program'",
    );
    let folder = RunFolder::resume(Purpose::Run, &path, &case.study(), &Call::default()).unwrap();
    assert!(folder.summary().unwrap().is_some());
}

#[test]
fn changes_that_change_no_number_are_taken() {
    let case = line();
    let whole = case.run();
    for (from, to) in [
        ("[study]", "# a comment\n[study]\nsays = \"another thought\""),
        ("[estimator]", "[fleet]\nworkers = 3\npatience = 5.0\n\n[estimator]"),
        ("passes = 2", "passes   =   2\nkind = \"roukf\""),
    ] {
        let path = interrupted(&case);
        let text = case.study().text;
        let changed = with(&text.replacen(from, to, 1));
        assert_ne!(changed.study().text, text, "{from}");
        let study = changed.study();
        let folder = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).unwrap();
        let summary = finish(folder, &study);
        assert_eq!(summary.parameters, whole.summary.parameters, "{to}");
        let posterior = RunFolder::open(&path).unwrap().store.meta("posterior").unwrap().unwrap();
        assert_eq!(posterior, whole.csv, "{to}");
    }
}

#[test]
fn a_run_is_begun_anew_where_its_start_was_killed() {
    let case = line();
    let whole = case.run();
    let study = case.study();
    let begin = |left: &[(&str, &str)], resume: bool| {
        let path = case.fresh();
        std::fs::create_dir_all(&path).unwrap();
        for (name, text) in left {
            std::fs::write(path.join(name), text).unwrap();
        }
        let folder = if resume {
            RunFolder::resume(Purpose::Run, &path, &study, &Call::default())
        } else {
            RunFolder::create(Purpose::Run, &path, &study, "test", "today")
        };
        finish(folder.unwrap(), &study);
        let names: Vec<_> = std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert!(names.iter().all(|name| !name.to_string_lossy().contains("unfinished")), "{names:?}");
        assert_eq!(RunFolder::open(&path).unwrap().store.meta("posterior").unwrap().unwrap(), whole.csv);
    };
    for resume in [false, true] {
        begin(&[], resume);
        begin(&[("run.db.unfinished", "")], resume);
        begin(&[("run.db.unfinished", "half a page"), ("run.db.unfinished-journal", "x")], resume);
    }
}

#[test]
fn a_start_killed_before_its_study_was_frozen_goes_on_and_freezes_it() {
    let case = line();
    let path = case.fresh();
    drop(RunFolder::create(Purpose::Run, &path, &case.study(), "test", "today").unwrap());
    std::fs::remove_file(path.join("study.toml")).unwrap();
    let study = case.study();
    finish(RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).unwrap(), &study);
    assert_eq!(std::fs::read_to_string(path.join("study.toml")).unwrap(), *study.text);
}

#[test]
fn an_empty_database_of_an_earlier_program_is_told_with_its_remedy() {
    let case = line();
    let path = case.fresh();
    std::fs::create_dir_all(&path).unwrap();
    std::fs::write(path.join("run.db"), "").unwrap();
    let error = refused(&path, &case.study()).to_string();
    assert!(
        error.contains("run.db holds nothing") && error.contains("remove the file and start again"),
        "{error}"
    );
}

#[test]
fn a_database_of_another_program_is_left_alone_and_said_to_be_one() {
    let case = line();
    let path = case.fresh();
    std::fs::create_dir_all(&path).unwrap();
    let foreign = rusqlite::Connection::open(path.join("run.db")).unwrap();
    foreign.execute_batch("CREATE TABLE birds (name TEXT)").unwrap();
    let error = refused(&path, &case.study()).to_string();
    assert!(error.contains("run.db is a database of another program: give the folder of a run"), "{error}");
    std::fs::write(path.join("run.db"), "a text of some length, and no database at all").unwrap();
    let error = refused(&path, &case.study()).to_string();
    assert!(error.contains("cannot use") && error.contains("give the folder of a run"), "{error}");
}

#[test]
fn a_resume_without_a_folder_starts_nothing() {
    let case = line();
    let path = case.fresh();
    assert!(refused(&path, &case.study()).to_string().contains("no run in"));
    assert!(!path.exists());
}

#[test]
fn the_wall_time_of_a_run_that_was_killed_without_an_event_is_kept() {
    let case = line();
    let path = case.fresh();
    let study = case.study();
    let mut folder = RunFolder::create(Purpose::Run, &path, &study, "test", "today").unwrap();
    let clock = std::cell::Cell::new(0.0);
    let now = || clock.replace(clock.get() + 1.0);
    let mut context =
        RunContext { clock: &now, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 1 };
    run(&study, &mut Mortal::new(9), &mut folder, &mut context).unwrap_err();
    drop(folder);
    let folder = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).unwrap();
    let before = folder.store.elapsed_s().unwrap();
    assert!(before >= 8.0, "eight analyses took a second each at least: {before}");
    assert!(finish(folder, &study).wall_s >= before);
}
