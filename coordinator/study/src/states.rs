//! The states of all particles over one record: a matrix while they are small, in the store of the fleet above that.
//!
//! What the filter does with them is the same for both, and so are the bits: every value follows from the values of its row, in the
//! order of the particles. Stored states are worked on a block of rows at a time, which is one piece of every state. Next file to
//! read: [`stored`].

pub(crate) mod stored;

use nalgebra::DMatrix;
use starlings_estimators::Recombination;
use starlings_fleet::{Fleet, FleetError, Held, StateError};

use stored::StoredStates;

/// Rows of a block of stored states.
pub(crate) use starlings_fleet::CHUNK_VALUES as BLOCK;

/// The states of all particles, a column per particle.
#[derive(Clone, Debug)]
pub enum States {
    /// In memory, n × r.
    Dense(DMatrix<f64>),
    /// In the store.
    Stored(StoredStates),
}

impl From<DMatrix<f64>> for States {
    fn from(x: DMatrix<f64>) -> Self {
        Self::Dense(x)
    }
}

impl States {
    /// The states that runs ended in; the column of a particle without one is zero.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn gather<'a>(
        ended: impl Iterator<Item = Option<&'a Held>> + Clone,
    ) -> Result<Self, StateError> {
        let stored = ended.clone().flatten().find_map(|held| match held {
            Held::Stored(state) => Some(state),
            Held::Values(_) => None,
        });
        if let Some(first) = stored {
            return Ok(Self::Stored(StoredStates::gather(first, ended)?));
        }
        let n = ended.clone().flatten().map(Held::n_state).max().unwrap_or(0);
        let mut x = DMatrix::zeros(n, ended.clone().count());
        for (mut column, held) in x.column_iter_mut().zip(ended) {
            if let Some(Held::Values(values)) = held {
                column.copy_from_slice(values);
            }
        }
        Ok(Self::Dense(x))
    }

    /// The state of one particle.
    pub(crate) fn held(&self, particle: usize) -> Held {
        match self {
            Self::Dense(x) => Held::Values(x.column(particle).iter().copied().collect()),
            Self::Stored(states) => Held::Stored(states.columns()[particle].clone()),
        }
    }

    /// X⁺ = X⁻T by up to so many threads; the bits do not depend on their number.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn recombine(&mut self, transform: &DMatrix<f64>, threads: usize) -> Result<(), StateError> {
        match self {
            Self::Dense(x) => recombine_by(x, transform, threads),
            Self::Stored(states) => *states = states.recombined(transform, threads)?,
        }
        Ok(())
    }

    /// The same, by workers where they and the states are in one place.
    ///
    /// # Errors
    /// When the store or the fleet fails.
    pub(crate) fn recombine_on(
        &mut self,
        fleet: &mut dyn Fleet,
        transform: &DMatrix<f64>,
        threads: usize,
    ) -> Result<(), FleetError> {
        if let Self::Stored(states) = self
            && let Some(mixed) = states.recombined_on(fleet, transform)?
        {
            *states = mixed;
            return Ok(());
        }
        Ok(self.recombine(transform, threads)?)
    }

    /// X⁺ = X⁻T for a transform that pulls particles, with the product of matrices.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn pull(&mut self, transform: &DMatrix<f64>) -> Result<(), StateError> {
        match self {
            Self::Dense(x) => *x = &*x * transform,
            Self::Stored(states) => *states = states.pulled(transform)?,
        }
        Ok(())
    }

    /// Calls `take` with every block of rows and the number of its first row.
    ///
    /// # Errors
    /// When the store fails.
    pub(crate) fn for_each_block(
        &self,
        mut take: impl FnMut(usize, &DMatrix<f64>),
    ) -> Result<(), StateError> {
        match self {
            Self::Dense(x) => {
                for first in (0..x.nrows()).step_by(BLOCK) {
                    take(first, &x.rows(first, BLOCK.min(x.nrows() - first)).into_owned());
                }
            }
            Self::Stored(states) => {
                for block in 0..states.n_blocks() {
                    take(block * BLOCK, &states.block(block)?);
                }
            }
        }
        Ok(())
    }
}

/// X⁺ = X⁻T by up to so many threads, of which the caller's is one.
pub fn recombine_by(x: &mut DMatrix<f64>, transform: &DMatrix<f64>, threads: usize) {
    let mut shares = Recombination::shares(x, transform, threads);
    let Some(own) = shares.pop() else { return };
    std::thread::scope(|scope| {
        for share in shares {
            scope.spawn(|| share.run());
        }
        own.run();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_shared_out_over_threads_have_the_bits_of_rows_made_alone() {
        // Just past the size from which threads share the work, and no multiple of any block.
        let (n, r) = (200_003, 22);
        let x = DMatrix::from_fn(n, r, |i, j| ((i * 31 + j * 17) % 1009) as f64 / 7.0);
        let t = DMatrix::from_fn(r, r, |i, j| 1.0 / (1 + i + 2 * j) as f64);
        let mut whole = x.clone();
        recombine_by(&mut whole, &t, 3);
        for first in (0..n).step_by(50_021) {
            let rows = 50_021.min(n - first);
            let mut part = x.rows(first, rows).into_owned();
            starlings_estimators::recombine(&mut part, &t);
            assert!(part == whole.rows(first, rows), "rows from {first}");
        }
    }
}
