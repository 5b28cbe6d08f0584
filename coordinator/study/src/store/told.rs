//! What the fleet told of its workers that whoever reads the result must know.
//!
//! Next file to read: [`super::Store`].

use super::{Store, StoreError};

/// Kinds of events that travel with the result.
const KINDS: [&str; 3] = ["worker-excluded", "workers-differ", "not-reproducible"];

/// Warnings of this kind that a result lists.
const LISTED: usize = 10;

impl Store {
    /// Warnings about workers whose results were not those of others, in the order in which they were found.
    ///
    /// # Errors
    /// When the database refuses.
    pub fn told_of_workers(&self) -> Result<Vec<String>, StoreError> {
        let select = "SELECT text FROM events WHERE kind IN (?1, ?2, ?3) ORDER BY id";
        let mut select = self.guard(self.connection.prepare_cached(select))?;
        let rows = self.guard(select.query_map(KINDS, |row| row.get::<_, String>(0)))?;
        let mut told = self.guard(rows.collect::<Result<Vec<_>, _>>())?;
        if told.len() > LISTED {
            let more = told.split_off(LISTED).len();
            told.push(format!("{more} more workers gave other results: see the events of the run."));
        }
        Ok(told)
    }
}
