//! When what was written becomes durable: a few quick analyses together, and what a snapshot needs before it.
//!
//! Next file to read: [`super::kept_states`].

use super::{Store, StoreError};

/// Analyses are committed together for at most so long, in s: a commit costs about as much as the rows of an analysis.
const HOLD_S: f64 = 0.05;

impl Store {
    /// Makes everything written so far durable.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn commit(&self) -> Result<(), StoreError> {
        if self.connection.is_autocommit() {
            return Ok(());
        }
        self.kept.borrow_mut().before_commit()?;
        self.guard(self.connection.execute_batch("COMMIT"))?;
        self.kept.borrow_mut().after_commit();
        Ok(())
    }

    /// [`Store::commit`], if the last one was [`HOLD_S`] or longer ago; `now_s` is the run's wall time. Before it `note` writes what
    /// belongs to this moment.
    ///
    /// # Errors
    /// When the database refuses.
    pub(crate) fn commit_if_due(
        &self,
        now_s: f64,
        note: impl FnOnce(&Self) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        if now_s - self.committed_s.get() >= HOLD_S.max(self.kept.borrow().hold_s()) {
            self.note_elapsed(now_s)?;
            note(self)?;
            self.commit()?;
            self.committed_s.set(now_s);
        }
        Ok(())
    }
}
