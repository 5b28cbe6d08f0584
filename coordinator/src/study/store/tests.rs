//! What only a store can be asked: that a disk without room is told and loses nothing.

use nalgebra::DMatrix;

use super::*;
use crate::study::store::snapshot::{Counts, Head, Matrix};

fn row(step: usize) -> AnalysisRow {
    AnalysisRow {
        pass: 1,
        step,
        time: 0.0,
        n_used: 1,
        nis: 1.0,
        log_likelihood: -1.0,
        information_lost: 0.0,
        transform: Some(DMatrix::zeros(30, 30)),
        estimates: Vec::new(),
        innovations: Vec::new(),
        jobs: Vec::new(),
    }
}

fn snapshot(step: usize) -> Snapshot {
    let head = Head {
        pass: 0,
        step,
        theta: Matrix::default(),
        centre: Vec::new(),
        scale: Vec::new(),
        batch: String::new(),
        nis: 0.0,
        n_used: step,
        log_likelihood: 0.0,
        information_lost: 0.0,
        dropped: 0.0,
        counts: Counts::default(),
    };
    Snapshot { head, states: vec![Some(DMatrix::from_element(8, 3, step as f64))] }
}

/// One analysis, committed as those of a slow run are.
fn keep(store: &mut Store, step: usize) -> Result<(), StoreError> {
    store.analysis(&row(step), &snapshot(step + 1))?;
    store.commit()
}

#[test]
fn quick_analyses_are_committed_together_and_at_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.db");
    let mut store = Store::create(&path, &[]).expect("a store");
    let seen =
        || table(&Store::open_to_read(&path).expect("readable"), "analyses", "step").expect("rows").len();
    let mut after = |step, now_s| {
        store.analysis(&row(step), &snapshot(step + 1)).expect("room");
        store.commit_if_due(now_s).expect("room");
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
    let mut store = Store::create(&path, &[]).expect("a store");
    // The database may grow by a few pages only, as on a disk with no more room.
    let pages: i64 =
        store.connection.pragma_query_value(None, "page_count", |row| row.get(0)).expect("its size");
    store
        .connection
        .pragma_update_and_check(None, "max_page_count", pages + 20, |_| Ok(()))
        .expect("a limit");
    let full = (0..1000).find_map(|step| keep(&mut store, step).err().map(|e| (step, e)));
    let (step, error) = full.expect("the limit is reached");
    assert!(step > 0, "some analyses fit");
    let text = error.to_string();
    for part in ["run.db", "the disk is full", "free some space", "--resume"] {
        assert!(text.contains(part), "`{part}` is missing: {text}");
    }
    drop(store);
    let mut store = Store::open(&path).expect("the store opens again");
    let kept = Snapshot::read(&store, 1).expect("readable").expect("a snapshot");
    assert_eq!(kept.head.step, step, "the snapshot is that of the last finished analysis");
    assert_eq!(table(&store, "analyses", "step").expect("rows").len(), step);
    store.analysis(&row(step), &snapshot(step + 1)).expect("with room again it goes on");
}
