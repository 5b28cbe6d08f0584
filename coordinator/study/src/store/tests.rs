//! Tests of the store alone: a disk without room is reported and loses nothing, answers are remembered.
#![allow(clippy::unwrap_used)]

use nalgebra::DMatrix;

use super::*;
use crate::store::snapshot::{Ensemble, Figures, Matrix};

fn row(step: usize) -> AnalysisRow {
    let (record, output) = ("one".to_owned(), "y".to_owned());
    let innovation = InnovationRow { record, output, time: 0.5, innovation: 0.25, sd: 0.125 };
    AnalysisRow {
        pass: 1,
        step,
        time: 0.0,
        n_used: 1,
        nis: 1.0,
        log_likelihood: -1.0,
        information_lost: 0.0,
        estimates: Vec::new(),
        innovations: vec![innovation; 100],
        jobs: Vec::new(),
    }
}

fn snapshot(step: usize) -> Snapshot {
    let figures = Figures { step, n_used: step, ..Figures::default() };
    let (centre, scale) = (Vec::new(), Vec::new());
    let estimate =
        Ensemble { theta: Matrix::default(), centre, scale, cost: None, narrow: 1.0, from_start: None }
            .into();
    Snapshot { figures, estimate, states: vec![Some(DMatrix::from_element(8, 3, step as f64).into())] }
}

/// One analysis, committed as those of a slow run are.
fn keep(store: &Store, step: usize) -> Result<(), StoreError> {
    store.analysis(&row(step), &snapshot(step + 1))?;
    store.commit()
}

#[test]
fn quick_analyses_are_committed_together_and_at_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.db");
    let store = Store::create(&path, &[]).expect("a store");
    let seen =
        || table(&Store::open_to_read(&path).expect("readable"), "analyses", "step").expect("rows").len();
    let after = |step, now_s| {
        store.analysis(&row(step), &snapshot(step + 1)).expect("room");
        store.commit_if_due(now_s, |_| Ok(())).expect("room");
        seen()
    };
    // The first at once, then nothing until the hold is over.
    assert_eq!(
        [after(0, 1.0), after(1, 1.01), after(2, 1.04), after(3, 1.06), after(4, 1.07)],
        [1, 1, 1, 4, 4]
    );
    drop(store);
    assert_eq!(seen(), 5);
}

#[test]
fn a_full_disk_is_told_with_its_remedy_and_keeps_every_committed_analysis() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.db");
    let store = Store::create(&path, &[]).expect("a store");
    // The database may grow by a few pages only, as on a disk with no more room.
    let pages: i64 =
        store.connection.pragma_query_value(None, "page_count", |row| row.get(0)).expect("its size");
    store
        .connection
        .pragma_update_and_check(None, "max_page_count", pages + 20, |_| Ok(()))
        .expect("a limit");
    let full = (0..1000).find_map(|step| keep(&store, step).err().map(|e| (step, e)));
    let (step, error) = full.expect("the limit is reached");
    assert!(step > 0, "some analyses fit");
    let text = error.to_string();
    for part in ["run.db", "the disk is full", "free some space", "--resume"] {
        assert!(text.contains(part), "`{part}` is missing: {text}");
    }
    drop(store);
    let store = Store::open(&path).expect("the store opens again");
    let kept = Snapshot::read(&store, 1, &starlings_fleet::StateStore::new(0))
        .expect("readable")
        .expect("a snapshot");
    assert_eq!(kept.figures.step, step, "the snapshot is that of the last finished analysis");
    assert_eq!(table(&store, "analyses", "step").expect("rows").len(), step);
    store.analysis(&row(step), &snapshot(step + 1)).expect("with room again it goes on");
}

#[test]
fn a_disk_that_is_full_before_there_is_a_run_is_not_to_be_resumed() {
    let full = rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_FULL), None);
    let error = StoreError::Database { path: "absent/run.db".into(), source: full }.to_string();
    assert!(error.contains("start again") && !error.contains("--resume"), "{error}");
}

/// An empty store in a folder of its own.
fn empty() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::create(&folder.path().join("run.db"), &[("study", "text")]).unwrap();
    (folder, store)
}

#[test]
fn answers_of_runs_are_remembered_by_their_key_and_over_a_kill() {
    let (folder, store) = empty();
    let (a, b, c) = ([1_u8; 32], [2_u8; 32], [3_u8; 32]);
    store.remember_runs([(&a, b"one".as_slice()), (&b, b"".as_slice())], &[]).unwrap();
    store.remember_runs([(&a, b"again".as_slice())], &[]).unwrap();
    // Neither closed nor dropped, as after a killed process.
    std::mem::forget(store);
    let store = Store::open(&folder.path().join("run.db")).unwrap();
    assert_eq!(store.remembered_run(&a).unwrap().as_deref(), Some(b"again".as_slice()));
    assert_eq!(store.remembered_run(&b).unwrap().as_deref(), Some(b"".as_slice()));
    assert_eq!(store.remembered_run(&c).unwrap(), None);
    assert_eq!(store.remembered_runs().unwrap().len(), 2);
}

#[test]
fn forgotten_answers_give_their_space_back() {
    let (folder, store) = empty();
    let path = folder.path().join("run.db");
    let body = vec![7_u8; 1 << 20];
    store.remember_runs([(&[1_u8; 32], body.as_slice())], &[]).unwrap();
    assert!(store.has_remembered_run(&[1; 32]).unwrap() && !store.has_remembered_run(&[2; 32]).unwrap());
    store.forget_runs().unwrap();
    assert_eq!(store.remembered_runs().unwrap().len(), 0);
    store.close_log().unwrap();
    let size = std::fs::metadata(path).unwrap().len();
    assert!(size < 1 << 18, "{size} bytes: what was forgotten is gone from the file");
    assert_eq!(store.meta("study").unwrap().as_deref(), Some("text"));
}

#[test]
fn a_store_without_a_table_of_remembered_runs_gets_one_when_it_is_opened() {
    let (folder, store) = empty();
    store.connection.execute_batch("DROP TABLE remembered_runs").unwrap();
    drop(store);
    let store = Store::open(&folder.path().join("run.db")).unwrap();
    assert_eq!(store.remembered_runs().unwrap().len(), 0);
    assert_eq!(store.folder(), folder.path());
}

#[test]
fn a_store_that_does_not_say_what_it_is_for_is_a_run() {
    let (_folder, store) = empty();
    assert_eq!(Purpose::of(&store).unwrap(), Purpose::Run);
    store.set_meta(Purpose::KEY, Purpose::Explanation.name()).unwrap();
    assert_eq!(Purpose::of(&store).unwrap(), Purpose::Explanation);
}
