//! The run's database: a row for every event, job and analysis, and a message with the remedy when it cannot be used.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::sync::Arc;
use std::sync::mpsc;

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::report::{FilesError, write_explanation};
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::store::folder::Call;
use starlings_coordinator::study::{FolderError, RunContext, RunFolder, Summary, run::run};
use study_kit::fleets::Mortal;
use study_kit::{Case, linear};

fn line(estimator: &str) -> Case {
    let (times, z) = linear::data(12, 8);
    Case::new(&linear::study(estimator), &[("line.csv", linear::file(&times, &z))])
}

#[test]
fn every_job_analysis_and_estimate_has_its_row() {
    let done = line("passes = 2").run();
    // Four particles; twelve windows, twice; then the final run, and four at and beside the estimate for the second interval.
    let jobs = done.table("jobs", "pass, step, particle, attempts, status, cost_s");
    assert_eq!(jobs.len(), 2 * 12 * 4 + 1 + 4);
    assert_eq!(done.summary.runs.total as usize, jobs.iter().filter(|row| row[0] != "0").count());
    assert!(jobs.iter().all(|row| row[3] == "1" && row[4] == "done" && row[5].parse::<f64>().is_ok()));
    for pass in 0..2 {
        for step in 0..12 {
            for particle in 0..4 {
                let at = 4 * (12 * pass + step) + particle;
                let expected = [pass + 1, step, particle].map(|n: usize| n.to_string());
                assert_eq!(jobs[at][..3], expected);
            }
        }
    }
    let analyses = done.table("analyses", "pass, step, time, n_used, nis, log_likelihood");
    assert_eq!(analyses.len(), 24);
    let sum = |column: usize| -> f64 {
        analyses.iter().filter(|row| row[0] == "2").map(|row| row[column].parse::<f64>().unwrap()).sum()
    };
    let fit = &done.summary.fit;
    // Sums of twelve numbers in another order.
    assert!((sum(4) / sum(3) / fit.nis_per_observation - 1.0).abs() < 1e-12);
    assert_eq!(done.table("estimates", "pass, step, parameter").len(), 24 * 3);
    assert_eq!(done.table("innovations", "pass, step").len(), 24);
    assert_eq!(done.table("predictions", "time").len(), 12);
    let last = done.table("estimates", "parameter, estimate").split_off(23 * 3);
    for (row, p) in last.iter().zip(&done.summary.parameters) {
        assert_eq!((row[0].as_str(), row[1].parse::<f64>().unwrap()), (p.name.as_str(), p.estimate));
    }
}

#[test]
fn the_batch_fit_has_a_row_per_ensemble() {
    let done = line("kind = \"batch\"").run();
    let n = done.table("analyses", "step").len();
    assert!(n >= 2);
    // The centre and four points.
    assert_eq!(done.summary.runs.total as usize, 5 * n);
    assert_eq!(done.table("jobs", "pass").len(), 5 * n + 1 + 4);
    assert_eq!(done.table("estimates", "step").len(), 3 * n);
}

#[test]
fn the_summary_that_is_read_back_is_the_summary_that_was_made() {
    for estimator in ["passes = 2", "kind = \"batch\"", "points = \"star\""] {
        let case = line(estimator);
        let done = case.run();
        let text = done.folder.store.meta("summary").unwrap().unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), done.summary);
        let reopened = RunFolder::open(&done.folder.path).unwrap();
        assert_eq!(reopened.summary().unwrap().unwrap(), done.summary);
        assert_eq!(reopened.store.meta("posterior").unwrap().unwrap(), done.csv);
    }
}

#[test]
fn a_resumed_run_keeps_its_clock_its_counts_and_one_row_per_job() {
    let case = line("passes = 2");
    let whole = case.run();
    let path = case.fresh();
    assert!(case.go(&path, &mut Mortal::new(17)).is_err());
    let study = case.study();
    let mut folder = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).unwrap();
    assert!(folder.summary().unwrap().is_none(), "an interrupted run has no summary");
    folder.store.event(7.5, "test", "time has passed").unwrap();
    let (mut steps, mut afterwards) = (Vec::new(), Vec::new());
    let (_sender, events) = mpsc::channel();
    let mut context = RunContext {
        clock: &|| 2.0,
        watch: &mut |p| {
            let told = if p.is_analysis() { &mut steps } else { &mut afterwards };
            told.push((p.pass, p.step, p.runs));
        },
        events: Some(&events),
        earlier_s: 0.0,
        threads: 1,
    };
    let summary = run(&study, &mut InProcess::new(1), &mut folder, &mut context).unwrap();
    assert!((summary.wall_s - 9.5).abs() < 1e-12, "7.5 s before, 2 s now: {}", summary.wall_s);
    assert_eq!(summary.runs, whole.summary.runs);
    assert_eq!(steps.first(), Some(&(2, 6, 18 * 4)), "seventeen analyses were there already");
    assert_eq!((steps.len(), steps.last().copied()), (7, Some((2, 12, 96))));
    // The final run, no observer, no constants, one run beside the estimate per parameter and one at it; the files.
    let runs: Vec<u64> = afterwards.iter().map(|told| told.2).collect();
    assert_eq!((runs[0], runs.len()), (96, 5), "runs of the part before the resume count");
    assert!(runs.is_sorted() && runs[3] > 96, "{runs:?}");
    let rows = |folder: &RunFolder, table, columns| {
        starlings_coordinator::study::store::table(&folder.store, table, columns).unwrap()
    };
    let jobs = "pass, step, particle, status";
    assert_eq!(rows(&folder, "jobs", jobs), rows(&whole.folder, "jobs", jobs));
    let texts: Vec<String> =
        rows(&folder, "events", "text").into_iter().map(|mut row| row.remove(0)).collect();
    assert_eq!(texts, ["run started", "time has passed", "run resumed", "run finished"]);
}

#[test]
fn a_folder_with_a_run_and_a_changed_study_are_refused() {
    let case = line("passes = 1");
    let done = case.run();
    let study = case.study();
    let occupied = RunFolder::create(Purpose::Run, &done.folder.path, &study, "", "").err().unwrap();
    assert!(matches!(occupied, FolderError::Occupied(_)), "{occupied}");
    assert!(occupied.to_string().contains("--resume"), "{occupied}");
    let path = done.folder.path.clone();
    let locked = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).err().unwrap();
    assert!(matches!(locked, FolderError::Locked { .. }), "the folder is still open: {locked}");
    drop(done);
    let mut changed = study.clone();
    changed.text = changed.text.replacen("passes = 1", "passes = 3", 1).into();
    changed.estimator.passes = Some(3);
    let error = RunFolder::resume(Purpose::Run, &path, &changed, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("the study file changed since: `estimator.passes` from 1 to 3;"), "{error}");
    let mut changed = study.clone();
    Arc::make_mut(&mut changed.records)[0].channels[0].values[3] += 1e-9;
    let error = RunFolder::resume(Purpose::Run, &path, &changed, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("the recordings changed since: `"), "{error}");
    let nowhere = case.fresh();
    let error =
        RunFolder::resume(Purpose::Run, &nowhere, &study, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("no run in") && error.contains("run.db"), "{error}");
}

#[test]
fn a_folder_says_which_command_it_belongs_to_and_that_its_explanation_is_not_finished() {
    let case = line("passes = 1");
    let (study, path) = (case.study(), case.fresh());
    let folder = RunFolder::create(Purpose::Explanation, &path, &study, "", "").unwrap();
    let error = write_explanation(&folder).err().unwrap();
    assert!(matches!(&error, FilesError::Unfinished(unfinished) if *unfinished == path), "{error}");
    let remedy = format!("continue it with `starlings explain STUDY --out {} --resume`", path.display());
    assert!(error.to_string().ends_with(&remedy), "{error}");
    assert_eq!(std::fs::read_dir(&path).unwrap().filter(|file| is_result(file.as_ref().unwrap())).count(), 0);
    drop(folder);
    let error = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("holds an explanation of `starlings explain`"), "{error}");
}

/// Whether a file of a run folder is made from its database.
fn is_result(file: &std::fs::DirEntry) -> bool {
    ["report.html", "explain.json", "explained.toml"].iter().any(|name| file.file_name() == *name)
}

#[test]
fn a_folder_that_holds_a_file_of_the_user_is_left_alone() {
    let case = line("passes = 1");
    let folder = case.fresh();
    std::fs::create_dir_all(&folder).unwrap();
    let mine = folder.join("study.toml");
    std::fs::write(&mine, "mine").unwrap();
    let error = RunFolder::create(Purpose::Run, &folder, &case.study(), "", "").err().unwrap();
    assert!(matches!(error, FolderError::InTheWay(_)), "{error}");
    assert_eq!(std::fs::read_to_string(&mine).unwrap(), "mine");
}

#[test]
fn a_damaged_database_is_named_with_its_damage() {
    let case = line("passes = 1");
    let study = case.study();
    let cases: [(&str, &str); 4] = [
        ("UPDATE snapshot SET head = '{\"pass\": 0'", "damaged snapshot"),
        ("UPDATE snapshot_states SET rows = 7", "wrong length"),
        ("UPDATE snapshot_states SET record = 9", "unknown record"),
        ("DROP TABLE snapshot", "no such table"),
    ];
    for (damage, words) in cases {
        let path = case.fresh();
        assert!(case.go(&path, &mut Mortal::new(5)).is_err());
        rusqlite::Connection::open(path.join("run.db")).unwrap().execute_batch(damage).unwrap();
        let error = case.go(&path, &mut InProcess::new(1)).err().unwrap().to_string();
        assert!(error.contains("run.db") && error.contains(words), "{damage}: {error}");
    }
    let path = case.fresh();
    assert!(case.go(&path, &mut Mortal::new(5)).is_err());
    std::fs::write(path.join("run.db"), "this is a text, not a database; ".repeat(50)).unwrap();
    let _ = std::fs::remove_file(path.join("run.db-wal"));
    let error = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("run.db") && error.contains("not a database"), "{error}");
    let path = case.fresh();
    assert!(case.go(&path, &mut Mortal::new(5)).is_err());
    rusqlite::Connection::open(path.join("run.db")).unwrap().pragma_update(None, "user_version", 99).unwrap();
    let error = RunFolder::resume(Purpose::Run, &path, &study, &Call::default()).err().unwrap().to_string();
    assert!(error.contains("version 99"), "{error}");
}
