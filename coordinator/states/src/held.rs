//! A state as the coordinator holds it: its values while it is small, the store's above that.

use starlings_models::StateValues;
use starlings_proto::{InKey, MAX_INLINE_STATE};

use crate::{StateError, StateStore, StoredState};

/// A state at the start or the end of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Held {
    /// Its values.
    Values(Vec<f64>),
    /// In the store.
    Stored(StoredState),
}

impl Default for Held {
    fn default() -> Self {
        Self::Values(Vec::new())
    }
}

impl From<Vec<f64>> for Held {
    fn from(values: Vec<f64>) -> Self {
        Self::Values(values)
    }
}

impl From<StateValues> for Held {
    fn from(values: StateValues) -> Self {
        Self::Values(values.into_vec())
    }
}

impl InKey for Held {
    fn in_key(&self) -> [u8; 32] {
        match self {
            Self::Values(values) => values.as_slice().in_key(),
            Self::Stored(state) => state.id(),
        }
    }
}

impl Held {
    /// Number of values.
    pub fn n_state(&self) -> usize {
        match self {
            Self::Values(values) => values.len(),
            Self::Stored(state) => state.n_state(),
        }
    }

    /// The values.
    ///
    /// # Errors
    /// When a piece in the folder is missing or damaged.
    pub fn into_values(self) -> Result<Vec<f64>, StateError> {
        match self {
            Self::Values(values) => Ok(values),
            Self::Stored(state) => state.values(),
        }
    }

    /// The state as a model sees it.
    ///
    /// # Errors
    /// As [`Held::into_values`].
    pub fn for_model(self) -> Result<StateValues, StateError> {
        self.into_values().map(StateValues::from)
    }

    /// The same state, in the store where it is too large to travel inside a message.
    ///
    /// # Errors
    /// When memory is full and the folder refuses.
    pub fn into_travelling(self, store: &StateStore) -> Result<Self, StateError> {
        match self {
            Self::Values(values) if values.len() * 8 > MAX_INLINE_STATE => {
                Ok(Self::Stored(store.keep(&values)?))
            }
            other => Ok(other),
        }
    }
}
