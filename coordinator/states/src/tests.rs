//! The store: same values back, bounded memory, nothing left behind, damage told.

use super::*;

fn values(n: usize, seed: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * 31 + seed * 7919) % 100_003) as f64 / 7.0).collect()
}

fn folder_files(path: &std::path::Path) -> Vec<String> {
    let names = std::fs::read_dir(path).into_iter().flatten();
    names.map(|entry| entry.expect("an entry").file_name().into_string().expect("a name")).collect()
}

fn is_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
}

#[test]
fn a_state_comes_back_as_it_went_in_whether_in_memory_or_not() {
    for memory in [usize::MAX, 0, CHUNK_VALUES * 8] {
        for n in [0, 1, CHUNK_VALUES, CHUNK_VALUES + 1, 3 * CHUNK_VALUES - 1] {
            let store = StateStore::new(memory);
            let x = values(n, 1);
            let state = store.keep(&x).expect("it is kept");
            assert!(is_same(&state.values().expect("it is there"), &x), "{n} values in {memory} bytes");
            assert_eq!(store.get(&state.id()).map(|s| s.n_state()), Some(n));
        }
    }
}

#[test]
fn memory_stays_below_its_limit_and_the_rest_is_in_the_folder_until_nobody_needs_it() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = scratch.path().join("states");
    let store = StateStore::new(2 * CHUNK_VALUES * 8);
    assert!(store.settle(&path));
    let states: Vec<_> = (0..4).map(|k| store.keep(&values(3 * CHUNK_VALUES, k)).expect("kept")).collect();
    assert_eq!(store.in_memory(), (2 * CHUNK_VALUES * 8, 2 * CHUNK_VALUES * 8));
    assert_eq!(folder_files(&path).len(), 10);
    for (k, state) in states.iter().enumerate() {
        assert!(is_same(&state.values().expect("it is there"), &values(3 * CHUNK_VALUES, k)));
    }
    let id = states[0].id();
    drop(states);
    assert_eq!((store.in_memory().0, store.n_pieces(), folder_files(&path).len()), (0, 0, 0));
    assert!(store.get(&id).is_none());
    store.clear();
    assert!(!path.exists());
}

#[test]
fn equal_pieces_are_held_once_and_go_with_their_last_state() {
    let store = StateStore::new(usize::MAX);
    let zeros = vec![0.0; 3 * CHUNK_VALUES];
    let (a, b) = (store.keep(&zeros).expect("kept"), store.keep(&zeros).expect("kept"));
    let longer = store.keep(&vec![0.0; 4 * CHUNK_VALUES]).expect("kept");
    assert_eq!(store.n_pieces(), 1);
    assert!(a == b && a != longer);
    drop((a, longer));
    assert!(store.get(&b.id()).is_some_and(|state| is_same(&state.values().expect("there"), &zeros)));
    drop(b);
    assert_eq!((store.n_pieces(), store.in_memory().0), (0, 0));
}

#[test]
fn a_state_that_is_not_finished_leaves_nothing() {
    let store = StateStore::new(CHUNK_VALUES * 8);
    let mut writer = store.writer(2 * CHUNK_VALUES);
    writer.push(vec![1; CHUNK_VALUES * 8].into()).expect("it fits");
    assert!(writer.push(vec![1; 8].into()).is_err(), "a piece of another length");
    assert!(writer.finish().is_err(), "a piece is missing");
    assert_eq!(store.n_pieces(), 0);
}

#[test]
fn what_is_persisted_is_reopened_and_the_rest_is_swept() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = scratch.path().join("states");
    let x = values(2 * CHUNK_VALUES + 5, 3);
    let pieces = {
        let store = StateStore::new(usize::MAX);
        store.settle(&path);
        let state = store.keep(&x).expect("kept");
        state.persist().expect("written");
        // As a killed process leaves them.
        std::fs::write(path.join("7.partial"), "half").expect("written");
        let pieces = state.pieces().to_vec();
        std::mem::forget(state);
        pieces
    };
    let store = StateStore::new(0);
    store.settle(&path);
    let state = store.reopen(x.len(), &pieces).expect("it is there");
    store.sweep();
    assert_eq!(folder_files(&path).len(), 3);
    assert!(is_same(&state.values().expect("it is there"), &x));
    assert!(store.reopen(x.len(), &pieces[..2]).is_err(), "a piece too few");
}

#[test]
fn a_damaged_and_a_missing_piece_are_named() {
    let scratch = tempfile::tempdir().expect("a folder");
    let store = StateStore::new(0);
    store.settle(scratch.path());
    let state = store.keep(&values(CHUNK_VALUES, 4)).expect("kept");
    let name = hex(&state.pieces()[0]);
    let file = scratch.path().join(&name);
    let mut bytes = std::fs::read(&file).expect("it is there");
    bytes[100] ^= 1;
    std::fs::write(&file, bytes).expect("written");
    let damaged = state.values().expect_err("it is damaged").to_string();
    assert!(damaged.contains(&name) && damaged.contains("damaged"), "{damaged}");
    std::fs::remove_file(&file).expect("removed");
    let missing = state.values().expect_err("it is gone").to_string();
    assert!(missing.contains(&name) && missing.contains("missing"), "{missing}");
    let again = StateStore::new(0);
    again.settle(scratch.path());
    assert!(matches!(
        again.reopen(CHUNK_VALUES, state.pieces()),
        Err(StateError::Piece(PieceError::Missing { .. }))
    ));
}

#[test]
fn threads_that_keep_and_drop_the_same_states_lose_none() {
    let scratch = tempfile::tempdir().expect("a folder");
    let store = StateStore::new(CHUNK_VALUES * 8);
    store.settle(scratch.path());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for k in 0..40 {
                    let x = values(2 * CHUNK_VALUES, k % 3);
                    let state = store.keep(&x).expect("kept");
                    assert!(is_same(&state.values().expect("it is there"), &x));
                }
            });
        }
    });
    assert_eq!((store.n_pieces(), store.in_memory().0, folder_files(scratch.path()).len()), (0, 0, 0));
}

#[test]
fn a_shared_folder_keeps_what_is_given_up_until_the_next_batch() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = scratch.path().join("run");
    let store = StateStore::shared(Folder::at(&path));
    assert!(store.settle(scratch.path()), "it stays where it is");
    let (a, b) = (values(CHUNK_VALUES + 1, 1), values(CHUNK_VALUES + 1, 2));
    let (first, second) = (store.keep(&a).expect("kept"), store.keep(&b).expect("kept"));
    assert_eq!((store.in_memory(), folder_files(&path).len()), ((0, 0), 4));
    let names = first.pieces().to_vec();
    drop((first, second));
    assert_eq!((store.n_pieces(), folder_files(&path).len()), (0, 4));
    // A worker ends in a state that was given up meanwhile.
    let mut writer = store.writer(a.len());
    for name in names {
        writer.push_existing(name).expect("it is there");
    }
    let again = writer.finish().expect("it is whole");
    store.tidy();
    assert_eq!(folder_files(&path).len(), 2);
    assert!(is_same(&again.values().expect("it is there"), &a));
    store.clear();
    assert!(!path.exists());
}
