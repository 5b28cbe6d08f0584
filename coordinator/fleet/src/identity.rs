//! Which run a fleet works for, and for the how manyeth time it was started.
//!
//! A worker that comes back brings results along for the same run only, and works for no start that is earlier than one that it has
//! seen. Next file to read: [`super::hub`].

use std::hash::{BuildHasher, Hasher};

/// A run and its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunIdentity {
    /// Drawn once per run.
    pub id: [u8; 16],
    /// How often the run was started, from 1.
    pub incarnation: u64,
}

impl RunIdentity {
    /// A run that nothing was known of before.
    pub fn new() -> Self {
        let half = || std::hash::RandomState::new().build_hasher().finish();
        Self { id: (u128::from(half()) << 64 | u128::from(half())).to_le_bytes(), incarnation: 1 }
    }
}

impl Default for RunIdentity {
    fn default() -> Self {
        Self::new()
    }
}
