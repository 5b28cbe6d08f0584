//! What a killed run finds again, and what it costs.

use super::super::snapshot::{Ensemble, Figures, Matrix, Snapshot};
use super::super::{AnalysisRow, ArrivedRun, Store};
use super::*;
use crate::states::States;
use crate::states::stored::StoredStates;

const N: usize = 40_000;

fn snapshot(states: &StateStore, step: usize) -> Snapshot {
    let column = |k: usize| {
        let values: Vec<f64> = (0..N).map(|i| (i * (k + 1) + step) as f64).collect();
        states.keep(&values).expect("room")
    };
    let figures = Figures { step, ..Figures::default() };
    let (centre, scale) = (Vec::new(), Vec::new());
    let estimate =
        Ensemble { theta: Matrix::default(), centre, scale, cost: None, narrow: 1.0, from_start: None }
            .into();
    let columns = StoredStates::of(N, (0..3).map(column).collect());
    Snapshot { figures, estimate, states: vec![None, Some(States::Stored(columns))] }
}

fn row(step: usize) -> AnalysisRow {
    AnalysisRow {
        pass: 1,
        step,
        time: 0.0,
        n_used: 1,
        nis: 1.0,
        log_likelihood: -1.0,
        information_lost: 0.0,
        estimates: Vec::new(),
        innovations: Vec::new(),
        jobs: Vec::new(),
    }
}

fn read(path: &std::path::Path) -> (Snapshot, StateStore) {
    let store = Store::open(&path.join("run.db")).expect("it opens");
    let states = StateStore::new(usize::MAX);
    assert!(states.settle(&path.join("states")));
    let snapshot = Snapshot::read(&store, 2, &states).expect("it is whole").expect("there is one");
    (snapshot, states)
}

fn second_column(snapshot: &Snapshot) -> Vec<f64> {
    snapshot.states[1].as_ref().expect("a running record").held(1).into_values().expect("it is there")
}

#[test]
fn a_run_killed_at_any_moment_has_the_pieces_of_the_snapshot_in_its_database() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
    let states = StateStore::new(usize::MAX);
    states.settle(&folder.path().join("states"));
    let files = || std::fs::read_dir(folder.path().join("states")).expect("a folder").count();
    for step in 0..4 {
        let now = snapshot(&states, step);
        store.analysis(&row(step), &now).expect("room");
        drop(now);
        if step > 0 {
            // Killed here, a resume goes on from the last commit.
            let (kept, _) = read(folder.path());
            assert_eq!(kept.figures.step, step - 1);
            assert!(second_column(&kept) == (0..N).map(|i| (2 * i + step - 1) as f64).collect::<Vec<_>>());
        }
        store.commit().expect("room");
        assert_eq!(files(), 6, "those of the snapshot before are gone");
    }
    assert_eq!(states.n_pieces(), 6);
    store.forget_states().expect("room");
    assert_eq!((states.n_pieces(), files()), (0, 0));
}

#[test]
fn a_run_that_arrived_with_a_large_state_is_found_again_until_its_analysis_is_stored() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
    let states = StateStore::new(usize::MAX);
    states.settle(&folder.path().join("states"));
    let files = || std::fs::read_dir(folder.path().join("states")).expect("a folder").count();
    let (key, values) = ([7; 32], (0..N).map(|i| i as f64 / 3.0).collect::<Vec<_>>());
    let state = Some(states.keep(&values).expect("room"));
    let run = ArrivedRun { attempts: 1, worker: "w".to_owned(), body: vec![1], state };
    store.keep_arrived(&[(key, run)]).expect("room");
    assert_eq!(files(), 2);
    // Killed here, a resume has it, and leaves it when it ends in order.
    let (again, fresh) = (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
    fresh.settle(&folder.path().join("states"));
    again.reopen_arrived(&fresh).expect("it is whole");
    fresh.sweep();
    let found = again.arrived(&key).expect("readable").expect("it is there");
    assert!(found.state.expect("in the folder").values().expect("readable") == values);
    drop(again);
    assert_eq!(files(), 2);
    // With a piece missing it is made again.
    let (third, fresh) = (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
    fresh.settle(&tempfile::tempdir().expect("a folder").path().join("states"));
    third.reopen_arrived(&fresh).expect("no error");
    assert_eq!(third.arrived(&key).expect("readable").and_then(|run| run.state), None);
    drop(third);
    store.analysis(&row(0), &snapshot(&states, 0)).expect("room");
    assert_eq!(files(), 2, "the row that names it stands until the commit");
    store.commit().expect("room");
    assert_eq!((files(), states.n_pieces()), (6, 6), "those of the snapshot alone");
    assert_eq!(store.arrived_keys().expect("readable").len(), 0);
    drop(store);
    assert_eq!(files(), 6, "an end in order leaves what a resume needs");
}

#[test]
fn runs_that_arrive_commit_no_snapshot_whose_pieces_have_taken_their_share_of_the_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
    let states = StateStore::new(usize::MAX);
    states.settle(&folder.path().join("states"));
    let run = ArrivedRun { attempts: 1, worker: "w".to_owned(), body: vec![1], state: None };
    let step = |step| store.analysis(&row(step), &snapshot(&states, step)).expect("room");
    step(0);
    store.commit().expect("room");
    step(1);
    store.kept.borrow_mut().took_s = 1000.0;
    store.keep_arrived(&[([7; 32], run.clone())]).expect("room");
    assert_eq!((read(folder.path()).0.figures.step, store.arrived_keys().expect("readable").len()), (0, 0));
    store.kept.borrow_mut().took_s = 0.0;
    store.keep_arrived(&[([7; 32], run)]).expect("room");
    assert_eq!((read(folder.path()).0.figures.step, store.arrived_keys().expect("readable").len()), (1, 1));
}

#[test]
fn a_piece_that_is_missing_on_resume_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::create(&folder.path().join("run.db"), &[]).expect("a store");
    let states = StateStore::new(usize::MAX);
    states.settle(&folder.path().join("states"));
    store.analysis(&row(0), &snapshot(&states, 0)).expect("room");
    store.commit().expect("room");
    let file = std::fs::read_dir(folder.path().join("states")).expect("a folder").next();
    let file = file.expect("a piece").expect("readable").path();
    std::fs::remove_file(&file).expect("removed");
    let (again, fresh) = (Store::open(&folder.path().join("run.db")).expect("it opens"), StateStore::new(0));
    fresh.settle(&folder.path().join("states"));
    let error = Snapshot::read(&again, 2, &fresh).expect_err("a piece is missing").to_string();
    assert!(error.contains(&file.file_name().expect("a name").to_string_lossy().into_owned()), "{error}");
    std::mem::forget(store);
}
