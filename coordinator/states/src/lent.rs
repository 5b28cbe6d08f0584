//! Memory that is lent to a worker of this machine, which writes states into it, one after the other.
//!
//! The coordinator makes it, of the length of a state, and counts it from then on. The worker can write there at any time, so
//! what is in it is copied first, then looked at; what is kept is the copy. Pages are given by the system once, not for every state, which
//! costs more than all else of a state's way. Next file to read: `memory`.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::{Arc, OnceLock};

use starlings_pieces::Mapped;
use starlings_proto::convert::state::CHUNK_BYTES;

use crate::memory::Memory;
use crate::shared::Shared;
use crate::{StateError, StateWriter, StoredState};

/// Memory for states of one length, which is counted until it is dropped.
#[derive(Debug)]
pub struct Lent {
    memory: Memory,
    n_state: usize,
    /// Its addresses, from the first state on.
    mapped: OnceLock<Option<Mapped>>,
}

impl Lent {
    pub(crate) fn new(store: &Arc<Shared>, n_state: usize) -> Option<Self> {
        Some(Self { memory: store.whole(n_state, true)?, n_state, mapped: OnceLock::new() })
    }

    /// Values of the states that it is for.
    pub fn n_state(&self) -> usize {
        self.n_state
    }

    /// Takes the state that was written into it into the store; this takes time.
    ///
    /// # Errors
    /// [`StateError::NotFinite`] when a value is not finite; others when the store cannot keep it.
    pub fn copy(&self, mut writer: StateWriter) -> Result<StoredState, StateError> {
        let mapped = self.mapped.get_or_init(|| self.memory.map());
        let (mut buffer, mut at) = (vec![0; CHUNK_BYTES], 0);
        while writer.wanted() > 0 {
            let bytes = &mut buffer[..8 * writer.wanted()];
            match mapped {
                Some(mapped) => mapped.read(bytes, at).map_err(Memory::failed("read"))?,
                None => self.memory.read(bytes, at)?,
            }
            if let Some(value) = not_finite(bytes) {
                return Err(StateError::NotFinite { value });
            }
            writer.push_copy(bytes)?;
            at += bytes.len();
        }
        writer.finish()
    }
}

impl AsFd for Lent {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.memory.as_fd()
    }
}

/// The first value among these bytes that is not finite.
pub fn not_finite(bytes: &[u8]) -> Option<f64> {
    /// Bits of the exponent, all set where a value is not finite (IEEE 754).
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    const SIGN: u64 = 1 << 63;
    let words = bytes.as_chunks::<8>().0;
    // One more in the exponent reaches the sign, which was taken off, only where all its bits are set.
    let run_over = |word: &[u8; 8]| (u64::from_le_bytes(*word) & EXPONENT).wrapping_add(1 << 52);
    // Without a way out of the loop several values are looked at together.
    if words.iter().fold(0, |any, word| any | run_over(word)) < SIGN {
        return None;
    }
    words.iter().find(|word| run_over(word) >= SIGN).map(|word| f64::from_le_bytes(*word))
}

#[cfg(test)]
mod tests {
    use starlings_pieces::SharedMemory;
    use starlings_proto::convert::floats;
    use starlings_proto::convert::state::{CHUNK_VALUES, name};

    use super::*;
    use crate::StateStore;

    const N: usize = 2 * CHUNK_VALUES + 5;
    const BYTES: usize = 8 * N;

    fn values(seed: usize) -> Vec<f64> {
        (0..N).map(|i| ((i * 31 + seed * 7919) % 100_003) as f64 / 7.0).collect()
    }

    fn lending(memory: usize) -> StateStore {
        let store = StateStore::new(memory);
        store.lends();
        store
    }

    /// The lent memory as its worker has it.
    fn of_worker(lent: &Lent) -> SharedMemory {
        let descriptor = lent.as_fd().try_clone_to_owned().expect("a descriptor");
        SharedMemory::received(descriptor, BYTES, false).expect("its length stays")
    }

    #[test]
    fn what_a_worker_wrote_is_the_state_of_its_values_and_what_it_writes_later_is_not() {
        let store = lending(64 * BYTES);
        let (x, y) = (values(1), values(2));
        let lent = store.lend(N).expect("room");
        assert_eq!((store.in_memory().0, store.n_pieces()), (BYTES, 0));
        let memory = of_worker(&lent);
        memory.write(&floats::encode(&x), 0).expect("it is the worker's");
        let first = lent.copy(store.writer(N)).expect("it is whole");
        memory.write(&floats::encode(&y), 0).expect("it is the worker's");
        assert!(first.id() == name(&x) && first.values().expect("it is there") == x);
        let second = lent.copy(store.writer(N)).expect("it is whole");
        assert!(second.id() == name(&y) && second.values().expect("it is there") == y);
        assert!(lent.copy(store.writer(N)).expect("it is whole") == second, "equal states are one");
        drop((first, second, lent));
        assert_eq!((store.in_memory().0, store.n_pieces()), (0, 0));
    }

    #[test]
    fn a_value_that_is_none_is_refused_and_leaves_nothing() {
        let store = lending(64 * BYTES);
        for (place, value) in [(0, f64::NAN), (CHUNK_VALUES, f64::INFINITY), (N - 1, f64::NEG_INFINITY)] {
            let lent = store.lend(N).expect("room");
            of_worker(&lent).write(&value.to_le_bytes(), 8 * place).expect("it is the worker's");
            let error = lent.copy(store.writer(N)).expect_err("no value");
            assert!(error.to_string().contains(&format!("{value} is a value of the state")), "{error}");
            drop(lent);
            assert_eq!((store.in_memory().0, store.n_pieces()), (0, 0));
        }
    }

    #[test]
    fn memory_is_lent_up_to_a_quarter_of_the_limit_and_states_beyond_the_limit_stand_in_pieces() {
        assert!(StateStore::new(usize::MAX).lend(N).is_none(), "nobody takes descriptors");
        // Less than the shortest piece is left over.
        let store = lending(8 * BYTES + 30);
        assert!(store.lend(CHUNK_VALUES).is_none(), "a small state travels in its message");
        let lent = (store.lend(N).expect("room"), store.lend(N).expect("room"));
        assert!(store.lend(N).is_none() && store.lend(usize::MAX).is_none());
        let states: Vec<_> = (0..7).map(|k| store.keep(&values(k)).expect("the folder has room")).collect();
        for (k, state) in states.iter().enumerate() {
            assert_eq!(state.descriptor().is_some(), k < 6, "number {k}");
            assert!(state.values().expect("it is there") == values(k));
        }
        assert_eq!(store.in_memory(), (8 * BYTES, 8 * BYTES));
        drop((lent, states));
        assert_eq!((store.in_memory().0, store.n_pieces()), (0, 0));
        assert!(store.lend(N).is_some(), "what was given back is lent again");
    }

    #[test]
    fn a_piece_that_another_state_needs_does_not_keep_the_memory_of_a_whole_one() {
        let store = lending(64 * BYTES);
        let (x, mut y) = (values(1), values(2));
        y[..CHUNK_VALUES].copy_from_slice(&x[..CHUNK_VALUES]);
        let whole = store.keep(&x).expect("room");
        assert!(whole.descriptor().is_some());
        let in_pieces = || {
            let mut writer = store.writer(N);
            for piece in y.chunks(CHUNK_VALUES) {
                writer.push_copy(&floats::encode(piece)).expect("room");
            }
            writer
        };
        let other = in_pieces().finish().expect("it is whole");
        assert_eq!(store.in_memory().0, 2 * BYTES - CHUNK_BYTES, "they share one piece");
        drop(whole);
        assert_eq!((store.in_memory().0, store.n_pieces()), (BYTES, 3));
        assert!(other.values().expect("it is there") == y);
        drop(other);
        assert_eq!((store.in_memory().0, store.n_pieces()), (0, 0));
        // The same where the whole one is not finished.
        let mut begun = store.writer_for_workers(N);
        begun.push(floats::encode(&x[..CHUNK_VALUES])).expect("room");
        let other = in_pieces().finish().expect("it is whole");
        drop(begun);
        assert_eq!((store.in_memory().0, store.n_pieces()), (BYTES, 3));
        assert!(other.values().expect("it is there") == y);
    }

    #[test]
    fn a_state_in_memory_is_persisted_and_reopened_as_any_other() {
        let scratch = tempfile::tempdir().expect("a folder");
        let path = scratch.path().join("states");
        let pieces = {
            let store = lending(usize::MAX);
            store.settle(&path);
            let state = store.keep(&values(5)).expect("room");
            state.persist().expect("the folder has room");
            state.leave();
            state.pieces().to_vec()
        };
        let store = lending(usize::MAX);
        store.settle(&path);
        let state = store.reopen(N, &pieces).expect("it is there");
        assert!(state.descriptor().is_none() && state.values().expect("it is there") == values(5));
        // The same values in memory are read there from then on.
        let again = store.keep(&values(5)).expect("room");
        assert!(again == state && again.values().expect("it is there") == values(5));
    }

    #[test]
    fn values_that_are_not_finite_are_found_wherever_they_are() {
        let mut x = values(6);
        assert_eq!(not_finite(&floats::encode(&x)), None);
        (x[7], x[8]) = (f64::MAX, -f64::MIN_POSITIVE / 4.0);
        assert_eq!(not_finite(&floats::encode(&x)), None);
        x[N - 2] = f64::NEG_INFINITY;
        assert_eq!(not_finite(&floats::encode(&x)), Some(f64::NEG_INFINITY));
    }
}
