//! States of particles in the store: block k of the rows of all of them is piece k of every one.
//!
//! A few blocks are in memory at a time, whatever the size of the states.

use nalgebra::DMatrix;
use starlings_fleet::{
    Fleet, FleetError, Held, Piece, Recombine, StateError, StateStore, StateWriter, StoredState, n_chunks,
};
use starlings_proto::convert::floats;

use super::BLOCK;

/// Blocks that are made at the same time, at most: the memory bandwidth limits more of them.
const THREADS: usize = 4;

/// Below so many rows another way of multiplying is taken, with other last bits.
const FEW_ROWS: usize = 16;

/// The states of all particles, in the store.
#[derive(Clone, Debug)]
pub struct StoredStates {
    n_state: usize,
    columns: Vec<StoredState>,
}

impl StoredStates {
    /// States of which each has so many values.
    pub(crate) fn of(n_state: usize, columns: Vec<StoredState>) -> Self {
        debug_assert!(columns.iter().all(|state| state.n_state() == n_state), "states of one model");
        Self { n_state, columns }
    }

    /// The states that runs ended in, of which one is `first`; the column of a particle without one is zero.
    pub(super) fn gather<'a>(
        first: &StoredState,
        ended: impl Iterator<Item = Option<&'a Held>>,
    ) -> Result<Self, StateError> {
        let (store, n_state) = (StateStore::of(first), first.n_state());
        let column = |held: Option<&Held>| match held {
            Some(Held::Stored(state)) => Ok(state.clone()),
            Some(Held::Values(values)) => store.keep(values),
            None => zero(&store, n_state),
        };
        Ok(Self::of(n_state, ended.map(column).collect::<Result<_, _>>()?))
    }

    /// The states, by particle.
    pub(crate) fn columns(&self) -> &[StoredState] {
        &self.columns
    }

    pub(super) fn n_blocks(&self) -> usize {
        n_chunks(self.n_state)
    }

    /// A block of rows of all particles.
    pub(super) fn block(&self, index: usize) -> Result<DMatrix<f64>, StateError> {
        let rows = BLOCK.min(self.n_state - index * BLOCK);
        let mut x = DMatrix::zeros(rows, self.columns.len());
        for (values, state) in x.as_mut_slice().chunks_mut(rows).zip(&self.columns) {
            state.read(index, values)?;
        }
        Ok(x)
    }

    /// X T by up to so many threads, each with blocks of its own.
    pub(super) fn recombined(&self, transform: &DMatrix<f64>, threads: usize) -> Result<Self, StateError> {
        let work = |x: &mut DMatrix<f64>| starlings_estimators::recombine(x, transform);
        self.mapped(threads.clamp(1, THREADS), &work)
    }

    /// X T by workers that share the place of the states; `None` where there are none.
    pub(super) fn recombined_on(
        &self,
        fleet: &mut dyn Fleet,
        transform: &DMatrix<f64>,
    ) -> Result<Option<Self>, FleetError> {
        let work = |x: &mut DMatrix<f64>| starlings_estimators::recombine(x, transform);
        let own = |block: usize| self.pieces_of(block, &work);
        let columns = &self.columns;
        let mixed = fleet.recombine(&Recombine { columns, transform: transform.as_slice(), own: &own })?;
        Ok(mixed.map(|columns| Self::of(self.n_state, columns)))
    }

    /// X T with the product of matrices.
    pub(super) fn pulled(&self, transform: &DMatrix<f64>) -> Result<Self, StateError> {
        let work = |x: &mut DMatrix<f64>| {
            let rows = x.nrows();
            // The whole has many rows, and the bits are to be those that it would have.
            let padded = x.clone().resize_vertically(rows.max(FEW_ROWS), 0.0);
            *x = (padded * transform).resize_vertically(rows, 0.0);
        };
        self.mapped(1, &work)
    }

    /// The states of which every block is made by `work` from the block of this one.
    fn mapped(&self, threads: usize, work: &(dyn Fn(&mut DMatrix<f64>) + Sync)) -> Result<Self, StateError> {
        let Some(first) = self.columns.first() else { return Ok(self.clone()) };
        let store = StateStore::of(first);
        let mut writers: Vec<StateWriter> =
            self.columns.iter().map(|_| store.writer_for_workers(self.n_state)).collect();
        for first in (0..self.n_blocks()).step_by(threads) {
            let last = (first + threads).min(self.n_blocks());
            for pieces in self.made(first..last, work) {
                for (writer, (name, bytes)) in writers.iter_mut().zip(pieces?) {
                    writer.push_named(name, bytes)?;
                }
            }
        }
        let columns = writers.into_iter().map(StateWriter::finish).collect::<Result<_, _>>()?;
        Ok(Self::of(self.n_state, columns))
    }

    /// The pieces of the block that `work` makes, by particle.
    fn pieces_of(
        &self,
        block: usize,
        work: &(dyn Fn(&mut DMatrix<f64>) + Sync),
    ) -> Result<Vec<Piece>, StateError> {
        let mut x = self.block(block)?;
        work(&mut x);
        let rows = x.nrows();
        let piece = |values: &[f64]| {
            let bytes = floats::encode(values);
            (starlings_proto::digest(&bytes), bytes)
        };
        Ok(x.as_slice().chunks(rows).map(piece).collect())
    }

    /// The pieces of some blocks, by block and particle; a thread for each, of which the caller's is one.
    fn made(
        &self,
        blocks: std::ops::Range<usize>,
        work: &(dyn Fn(&mut DMatrix<f64>) + Sync),
    ) -> Vec<Result<Vec<Piece>, StateError>> {
        let make = |block: usize| self.pieces_of(block, work);
        std::thread::scope(|scope| {
            let others: Vec<_> =
                blocks.clone().skip(1).map(|block| scope.spawn(move || make(block))).collect();
            let own = blocks.clone().next().map(make);
            let others = others
                .into_iter()
                .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
            own.into_iter().chain(others).collect()
        })
    }
}

/// A state of zeros.
fn zero(store: &StateStore, n_state: usize) -> Result<StoredState, StateError> {
    let mut writer = store.writer(n_state);
    while writer.wanted() > 0 {
        writer.push(floats::encode(&vec![0.0; writer.wanted()]))?;
    }
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::super::States;
    use super::*;

    /// Ensembles whose last block has few rows, many, and all.
    const LENGTHS: [usize; 4] = [BLOCK + 3, 2 * BLOCK - 17, 3 * BLOCK, 4 * BLOCK + 1];

    fn both(n: usize, r: usize, store: &StateStore) -> (States, States) {
        let x = DMatrix::from_fn(n, r, |i, j| {
            if (i + j) % 97 == 0 { -0.0 } else { ((i * 31 + j * 17) % 1009) as f64 / 7.0 - 60.0 }
        });
        let columns = x.column_iter().map(|c| store.keep(c.as_slice()).expect("it is kept")).collect();
        (x.into(), States::Stored(StoredStates::of(n, columns)))
    }

    fn bits(x: &States) -> Vec<u64> {
        let mut all = Vec::new();
        for j in 0.. {
            let columns = match x {
                States::Dense(x) => x.ncols(),
                States::Stored(states) => states.columns().len(),
            };
            if j == columns {
                return all;
            }
            all.extend(x.held(j).into_values().expect("it is there").iter().map(|v| v.to_bits()));
        }
        unreachable!("it ends with the last column")
    }

    #[test]
    fn stored_states_are_mixed_to_the_bits_of_those_in_memory() {
        for (n, r) in LENGTHS.into_iter().zip([3, 7, 22, 6]) {
            for memory in [usize::MAX, BLOCK * 8] {
                let store = StateStore::new(memory);
                let (mut dense, mut stored) = both(n, r, &store);
                let t = DMatrix::from_fn(r, r, |i, j| (1.0 + i as f64) / (1 + i + 2 * j) as f64 - 0.3);
                for threads in [1, 3] {
                    dense.recombine(&t, threads).expect("no store");
                    stored.recombine(&t, threads).expect("room");
                    assert!(bits(&dense) == bits(&stored), "{n} × {r} by {threads} threads");
                }
                let mut pull = DMatrix::identity(r, r);
                pull.column_mut(1).fill(0.5 / r as f64);
                dense.pull(&pull).expect("no store");
                stored.pull(&pull).expect("room");
                assert!(bits(&dense) == bits(&stored), "{n} × {r} pulled");
            }
        }
    }

    #[test]
    fn a_dropped_particle_may_hold_anything_and_blocks_are_those_of_the_matrix() {
        let store = StateStore::new(usize::MAX);
        let (dense, stored) = both(2 * BLOCK + 5, 4, &store);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        dense.for_each_block(|first, x| a.push((first, x.clone()))).expect("no store");
        stored.for_each_block(|first, x| b.push((first, x.clone()))).expect("they are there");
        assert_eq!(
            a.iter().map(|(first, x)| (*first, x.nrows())).collect::<Vec<_>>(),
            [(0, BLOCK), (BLOCK, BLOCK), (2 * BLOCK, 5)]
        );
        assert!(a == b);
        let ended = [Some(stored.held(0)), None, Some(stored.held(2))];
        let mut gathered = States::gather(ended.iter().map(Option::as_ref)).expect("room");
        assert!(gathered.held(1).into_values().expect("it is there").iter().all(|v| v.to_bits() == 0));
        let mut t = DMatrix::from_element(3, 3, 0.5);
        t.row_mut(1).fill(0.0);
        gathered.recombine(&t, 2).expect("room");
        drop((stored, ended, gathered));
        assert_eq!(store.n_pieces(), 0);
    }
}
