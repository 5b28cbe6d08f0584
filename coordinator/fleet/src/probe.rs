//! By which workers find out whether they see the folder for states.

use starlings_states::{StateStore, StoredState};

use crate::FleetError;

/// A piece that nobody else can have made, in the folder that workers may share.
pub(super) fn probe(states: &StateStore) -> Result<Option<StoredState>, FleetError> {
    if !states.is_shared() {
        return Ok(None);
    }
    let mut drawn = [0; 32];
    getrandom::fill(&mut drawn).map_err(|error| FleetError::Stopped(error.to_string()))?;
    let values: Vec<f64> = drawn.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    Ok(Some(states.keep(&values)?))
}
