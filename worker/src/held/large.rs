//! Results with large states: they fit into no message, so they are put when the coordinator gives a lease for them again.
//!
//! In memory, or each in a file without a name. Next file to read: [`super`].

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use starlings_models::{ParticleError, Prediction, StateValues};
use starlings_proto::{Lease, State};

use crate::transfer::Transfers;

/// What a run predicted that ended in a large state.
pub(crate) struct Large {
    outputs: Vec<f64>,
    cost: f64,
    n_state: usize,
    state: Mutex<Place>,
}

/// Where the values of a state are.
enum Place {
    Memory(StateValues),
    Disk(File),
}

impl Large {
    pub(crate) fn new(prediction: Prediction) -> Self {
        let Prediction { outputs, state, cost } = prediction;
        Self { outputs, cost, n_state: state.len(), state: Mutex::new(Place::Memory(state)) }
    }

    /// Bytes of its state in memory, and in a file.
    pub(super) fn bytes(&self) -> (usize, u64) {
        match *self.place() {
            Place::Memory(_) => (8 * self.n_state, 0),
            Place::Disk(_) => (0, 8 * self.n_state as u64),
        }
    }

    /// Moves its state to a file.
    pub(super) fn spill(&self, scratch: &Path) -> io::Result<()> {
        let mut place = self.place();
        if let Place::Memory(values) = &*place {
            let mut file = BufWriter::new(tempfile::tempfile_in(scratch)?);
            for value in values {
                file.write_all(&value.to_le_bytes())?;
            }
            *place = Place::Disk(file.into_inner().map_err(io::IntoInnerError::into_error)?);
        }
        Ok(())
    }

    /// The prediction, once its state has arrived at the coordinator. For a thread that may wait.
    pub(crate) fn put(
        &self,
        transfers: &Transfers,
        lease: Lease,
    ) -> Result<Prediction<State>, ParticleError> {
        let unreadable = |error: io::Error| {
            ParticleError::Infrastructure(format!(
                "its end state was held on disk and cannot be read: {error}"
            ))
        };
        let state = State::Named(transfers.put(lease, &self.values().map_err(unreadable)?)?);
        Ok(Prediction { outputs: self.outputs.clone(), state, cost: self.cost })
    }

    /// Wall time of the run, seconds.
    pub(crate) fn cost(&self) -> f64 {
        self.cost
    }

    /// The memory of its state.
    pub(crate) fn into_memory(self) -> Option<Vec<f64>> {
        match self.state.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Place::Memory(values) => values.into_own(),
            Place::Disk(_) => None,
        }
    }

    fn values(&self) -> io::Result<StateValues> {
        match &mut *self.place() {
            Place::Memory(values) => Ok(values.clone()),
            Place::Disk(file) => {
                file.rewind()?;
                let (mut file, mut word) = (BufReader::new(file), [0; 8]);
                let mut values = Vec::with_capacity(self.n_state);
                for _ in 0..self.n_state {
                    file.read_exact(&mut word)?;
                    values.push(f64::from_le_bytes(word));
                }
                Ok(values.into())
            }
        }
    }

    fn place(&self) -> MutexGuard<'_, Place> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_on_disk_has_the_bits_that_it_had_in_memory() {
        let state = vec![1.0, -0.0, f64::MIN_POSITIVE / 2.0];
        let large = Large::new(Prediction { outputs: vec![2.0], state: state.clone().into(), cost: 0.5 });
        assert_eq!(large.bytes(), (24, 0));
        large.spill(&std::env::temp_dir()).unwrap();
        assert_eq!(large.bytes(), (0, 24));
        // As often as it is needed.
        for _ in 0..2 {
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&large.values().unwrap()), bits(&state));
        }
        assert_eq!(large.into_memory(), None);
    }
}
