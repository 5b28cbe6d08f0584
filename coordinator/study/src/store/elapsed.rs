//! How far a run has come, in s of its wall time over all its starts.
//!
//! Next file to read: [`crate::store`].

use super::{Store, StoreError};

/// Name under which the store keeps it.
const ELAPSED: &str = "elapsed_s";

impl Store {
    /// How far the run had come, in s of its wall time: the last commit or the last event, whichever is later; zero for a
    /// new run.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn elapsed_s(&self) -> Result<f64, StoreError> {
        let of_events = "SELECT coalesce(max(at_s), 0.0) FROM events";
        let told: f64 = self.guard(self.connection.query_row(of_events, [], |row| row.get(0)))?;
        let kept = self.meta(ELAPSED)?.and_then(|text| text.parse().ok());
        Ok(kept.unwrap_or(0.0_f64).max(told))
    }

    /// Stores how far the run has come.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn note_elapsed(&self, now_s: f64) -> Result<(), StoreError> {
        self.set_meta(ELAPSED, &now_s.to_string())
    }
}
