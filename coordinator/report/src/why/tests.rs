//! Answers about a made-up store of a run that was killed.

use starlings_fleet::FleetEvent;
use starlings_study::RunFolder;
use starlings_study::store::folder::StudyInfo;
use starlings_study::store::snapshot::{Counts, Ensemble, Figures, Matrix, Snapshot};
use starlings_study::store::{AnalysisRow, EstimateRow, InnovationRow, JobRow, Store};

use super::{Answer, WhyError, why};

fn job(step: usize, particle: u32, worker: &str, error: Option<&str>) -> JobRow {
    JobRow {
        pass: 1,
        step,
        record: "one".into(),
        particle,
        attempts: 1,
        worker: worker.into(),
        error: error.map(ToOwned::to_owned),
        cost_s: 1.5,
        answer: None,
    }
}

fn estimate(mean: f64, sd: f64) -> EstimateRow {
    EstimateRow { parameter: "R".into(), estimate: mean, lo: mean - 2.0 * sd, hi: mean + 2.0 * sd, mean, sd }
}

fn analysis(step: usize, (mean, sd): (f64, f64), innovation: f64, jobs: Vec<JobRow>) -> AnalysisRow {
    AnalysisRow {
        pass: 1,
        step,
        time: step as f64,
        n_used: 1,
        nis: 1.0,
        log_likelihood: -1.0,
        information_lost: 0.0,
        estimates: vec![estimate(mean, sd)],
        innovations: vec![InnovationRow {
            record: "one".into(),
            output: "p".into(),
            time: step as f64,
            innovation,
            sd: 2.0,
        }],
        jobs,
    }
}

/// Three analyses: the second brings three quarters of the information, and its particle 1 fails on worker 2, which leaves.
fn killed() -> (tempfile::TempDir, RunFolder) {
    let place = tempfile::tempdir().expect("a folder");
    let info = serde_json::to_string(&StudyInfo::default()).expect("JSON");
    let store =
        Store::create(&place.path().join("run.db"), &[("info", &info), ("purpose", "run")]).expect("a store");
    let snapshot = || -> Snapshot {
        let figures = Figures { step: 1, n_used: 1, counts: Counts::default(), ..Figures::default() };
        let (centre, scale) = (Vec::new(), Vec::new());
        let ensemble =
            Ensemble { theta: Matrix::default(), centre, scale, cost: None, narrow: 1.0, from_start: None };
        Snapshot { figures, estimate: ensemble.into(), states: Vec::new() }
    };
    let rows = [
        analysis(0, (1.0, 1.0), 0.5, vec![job(0, 0, "1@h/1", None), job(0, 1, "2@h/2", None)]),
        analysis(
            1,
            (1.5, 0.125),
            -6.0,
            vec![job(1, 0, "1@h/1", None), job(1, 1, "2@h/2", Some("too stiff")), job(1, 1, "1@h/1", None)],
        ),
        analysis(2, (1.5, 0.062_5), 1.0, vec![job(2, 0, "1@h/1", None), job(2, 1, "1@h/1", None)]),
    ];
    for row in &rows {
        store.analysis(row, &snapshot()).expect("stored");
    }
    let left =
        FleetEvent::WorkerLeft { worker: "2@h/2".into(), reason: "its stream broke".into(), requeued: 1 };
    store.event(1.0, left.kind(), &left.to_string()).expect("stored");
    drop(store);
    let folder = RunFolder::open(place.path()).expect("a run");
    (place, folder)
}

fn says(folder: &RunFolder, about: Option<&str>) -> (String, String) {
    let Answer { about, says } = why(folder, about).expect("an answer");
    (about, says.join(" "))
}

#[test]
fn a_parameter_is_told_by_the_analyses_that_informed_it() {
    let (_place, folder) = killed();
    let (about, says) = says(&folder, Some("R"));
    assert_eq!(about, "parameter R");
    // From sd 1 to 1/16: ln 16 in all, ln 8 of it at time 1.
    assert!(says.contains("It went from 1.000 to 1.500, 0.5000 prior sd"), "{says}");
    assert!(says.contains("Half of what pass 1 brought had arrived by 1.000."), "{says}");
    assert!(says.contains("1.000 (p of one, 75\u{a0}% of it); 2.000 (p of one, 25\u{a0}% of it)"), "{says}");
}

#[test]
fn an_observation_is_told_by_its_surprise_and_what_it_moved() {
    let (_place, folder) = killed();
    let (about, text) = says(&folder, Some("p"));
    assert_eq!(about, "observation p of one at 1.000");
    assert!(text.contains("It lay 6.000 below what was expected, 3.000 of the sd"), "{text}");
    assert!(text.contains("moved R by 0.5000 of the sd"), "{text}");
    let (about, _) = says(&folder, Some("p@1.9"));
    assert_eq!(about, "observation p of one at 2.000", "the nearest one");
}

#[test]
fn a_worker_a_particle_and_the_run_are_told_by_what_became_of_them() {
    let (_place, folder) = killed();
    let (_, worker) = says(&folder, Some("2@h/2"));
    assert!(
        worker.contains("It answered 2 runs, of which 1 failed.") && worker.contains("its stream broke"),
        "{worker}"
    );
    let (_, other) = says(&folder, Some("1@h/1"));
    assert!(other.contains("Nothing was told against it"), "{other}");
    let (_, particle) = says(&folder, Some("1"));
    assert!(particle.contains("It was run 4 times; 1 failed for good"), "{particle}");
    assert!(
        particle.contains("pulled towards the mean at 1 analysis, last at pass 1, analysis 1"),
        "{particle}"
    );
    assert!(particle.contains("1 run failed: too stiff."), "{particle}");
    let (_, still) = says(&folder, Some("0"));
    assert!(still.contains("never moved by a failure"), "{still}");
    let (_, run) = says(&folder, None);
    assert!(
        run.contains("Nobody runs it")
            && run.contains("--resume goes on")
            && run.contains("1 run failed: too stiff"),
        "{run}"
    );
}

#[test]
fn a_name_that_nothing_has_is_refused_with_those_that_there_are() {
    let (_place, folder) = killed();
    for odd in ["Q", "7", "p@then", "'; DROP TABLE jobs; --"] {
        let refused = why(&folder, Some(odd)).expect_err("nothing is called so");
        let WhyError::Unknown { asked, parameters, last, .. } = refused else { panic!("{refused}") };
        assert_eq!((asked.as_str(), parameters.as_str(), last), (odd, "R", 1));
    }
}
