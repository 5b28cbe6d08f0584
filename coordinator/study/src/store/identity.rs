//! Which run a store is of, and how often that was started: what workers of an earlier start know it by.
//!
//! Next file to read: [`starlings_fleet::RunIdentity`].

use starlings_fleet::RunIdentity;

use super::{Store, StoreError};

/// Name under which the store keeps what was drawn once.
const RUN_ID: &str = "run_id";

/// Name under which the store counts starts.
const STARTS: &str = "starts";

impl Store {
    /// Counts a start of the run, durably, and says which run and which start it is.
    ///
    /// # Errors
    /// When the database refuses or its content is damaged.
    pub fn begin(&self) -> Result<RunIdentity, StoreError> {
        self.commit()?;
        let id = if let Some(text) = self.meta(RUN_ID)? {
            u128::from_str_radix(&text, 16).map_err(|e| self.damaged("run id", e))?.to_be_bytes()
        } else {
            let id = RunIdentity::new().id;
            self.set_meta(RUN_ID, &format!("{:032x}", u128::from_be_bytes(id)))?;
            id
        };
        let starts = self.meta(STARTS)?.map_or(Ok(0), |text| text.parse::<u64>());
        let incarnation = starts.map_err(|e| self.damaged("number of starts", e))? + 1;
        self.set_meta(STARTS, &incarnation.to_string())?;
        Ok(RunIdentity { id, incarnation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_start_of_a_run_has_its_number_and_all_have_one_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.db");
        let first = Store::create(&path, &[]).expect("a store").begin().expect("room");
        assert_eq!(first.incarnation, 1);
        let second = Store::open(&path).expect("it is there").begin().expect("room");
        assert_eq!(second, RunIdentity { incarnation: 2, ..first });
        let other = Store::create(&folder.path().join("other.db"), &[]).expect("a store");
        assert_ne!(other.begin().expect("room").id, first.id);
    }
}
