//! What is read from the store of a run that is not finished.

#![allow(clippy::float_cmp, clippy::unwrap_used)] // the compared numbers are copies; a failed unwrap is a failed test

use starlings_estimators::nis_band;
use starlings_fleet::FleetEvent;
use starlings_study::store::snapshot::{Counts, Ensemble, Figures, Matrix, Snapshot};
use starlings_study::store::{AnalysisRow, JobRow};

use super::*;

fn job(step: usize, particle: u32, attempts: u32, error: Option<&str>) -> JobRow {
    JobRow {
        pass: 1,
        step,
        record: "one".into(),
        particle,
        attempts,
        worker: "1@node-07/311".into(),
        error: error.map(ToOwned::to_owned),
        cost_s: if error.is_some() { 0.0 } else { 1.5 },
        answer: None,
    }
}

fn analysis(step: usize, n_used: usize, jobs: Vec<JobRow>) -> AnalysisRow {
    AnalysisRow {
        pass: 1,
        step,
        time: step as f64,
        n_used,
        nis: 3.0,
        log_likelihood: -1.0,
        information_lost: 0.0,
        estimates: Vec::new(),
        innovations: Vec::new(),
        jobs,
    }
}

fn snapshot(rescued: u64) -> Snapshot {
    let counts = Counts { rescued, ..Counts::default() };
    let figures = Figures { step: 1, n_used: 1, counts, ..Figures::default() };
    let (centre, scale) = (Vec::new(), Vec::new());
    let estimate =
        Ensemble { theta: Matrix::default(), centre, scale, cost: None, narrow: 1.0, from_start: None }
            .into();
    Snapshot { figures, estimate, states: Vec::new() }
}

#[test]
fn parameters_that_differ_by_a_number_are_a_family() {
    let row = |name: &str, unit: &str| ParameterRow {
        name: name.into(),
        unit: unit.into(),
        ..ParameterRow::default()
    };
    let rows =
        [row("E10", "kPa"), row("k_s", ""), row("E2", "kPa"), row("E1", "kPa"), row("R1", ""), row("R2", "")];
    let found = families(&rows, &["E10", "E2", "E1"].map(str::to_owned));
    assert_eq!(found.len(), 1, "two are no family: {found:?}");
    assert_eq!((found[0].stem.as_str(), found[0].stiffness), ("E", true));
    assert_eq!(found[0].members, [(1, 3), (2, 2), (10, 0)]);
    assert!(!families(&rows, &["E1".to_owned()])[0].stiffness);
}

/// Two analyses of a run that was killed: one value used, then two; one run retried, one failed and rescued.
fn killed() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let info = serde_json::to_string(&StudyInfo::default()).unwrap();
    let store = Store::create(&folder.path().join("run.db"), &[("info", &info)]).unwrap();
    let joined = FleetEvent::WorkerJoined {
        worker: "1@node-07/311".into(),
        host: "node-07".into(),
        pid: 311,
        slots: 2,
        cores: 4,
        build: String::new(),
    };
    store.event(0.5, joined.kind(), &joined.to_string()).unwrap();
    store.analysis(&analysis(0, 1, vec![job(0, 0, 1, None), job(0, 1, 3, None)]), &snapshot(0)).unwrap();
    let jobs = vec![job(1, 0, 2, Some("the step is too small")), job(1, 0, 1, None), job(1, 1, 1, None)];
    store.analysis(&analysis(1, 2, jobs), &snapshot(1)).unwrap();
    (folder, store)
}

#[test]
fn an_unfinished_run_counts_what_its_jobs_say() {
    let (_folder, store) = killed();
    let fleet = report_data(&store).unwrap().fleet;
    assert_eq!((fleet.runs_total, fleet.failed, fleet.retried, fleet.rescued), (5, 1, 3, 1));
    assert_eq!(fleet.workers[0].busy_share, None, "the wall time of a killed run is not known");
}

#[test]
fn runs_of_the_fit_and_those_after_it_add_up_to_the_jobs_of_the_workers() {
    let (_folder, store) = killed();
    let mut fitted = summary();
    fitted.runs.total = 3;
    let fleet = fleet::table(&store, Some(&fitted)).unwrap();
    let jobs: u64 = fleet.workers.iter().map(|worker| worker.jobs).sum();
    assert_eq!((fleet.runs_total, fleet.runs_after, fleet.runs_total + fleet.runs_after), (3, 2, jobs));
}

#[test]
fn each_analysis_has_the_band_of_the_values_it_used() {
    let (_folder, store) = killed();
    let series = report_data(&store).unwrap().nis.remove(0);
    let bands = [nis_band(1, 0.95), nis_band(2, 0.95)];
    assert_ne!(bands[0], bands[1]);
    assert_eq!(series.n_used, [1, 2]);
    assert_eq!(series.nis_per_observation, [3.0, 1.5]);
    assert_eq!(series.lo, bands.map(|b| b.0));
    assert_eq!(series.hi, bands.map(|b| b.1));
}

/// A summary of a run of ten seconds.
fn summary() -> Summary {
    let json = serde_json::json!({
        "study": "s", "model": "m", "estimator": "e", "seed": 1, "parameters": [], "correlation": [],
        "fit": { "channels": [], "records": [], "nis_per_observation": 1.0, "log_likelihood": 0.0 },
        "runs": { "total": 5, "failed": 1, "retried": 3, "rescued": 1 },
        "workers": 1, "wall_s": 10.0, "warnings": [], "conditional_on": "",
    });
    serde_json::from_value(json).unwrap()
}

#[test]
fn a_worker_is_busy_by_the_share_of_its_slots() {
    let (_folder, store) = killed();
    // Four runs of 1.5 s in 10 s on two slots.
    let of_two = fleet::table(&store, Some(&summary())).unwrap();
    assert_eq!(of_two.workers[0].busy_share, Some(0.3));
    let unknown = tempfile::tempdir().unwrap();
    let store = Store::create(&unknown.path().join("run.db"), &[]).unwrap();
    store.analysis(&analysis(0, 1, vec![job(0, 0, 1, None)]), &snapshot(0)).unwrap();
    let without_event = fleet::table(&store, Some(&summary())).unwrap();
    assert_eq!(without_event.workers[0].busy_share, None);
}
