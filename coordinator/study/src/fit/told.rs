//! A fleet's failure in the names of a study.
//!
//! Next file to read: [`super::runner`].

use starlings_fleet::FleetError;

use crate::{RunError, Study};

/// A fleet's failure, with names and values where it is about one run.
pub(super) fn told(study: &Study, error: FleetError, values: impl Fn(usize) -> Option<String>) -> RunError {
    match error {
        FleetError::NoAnswer { job, particle, record, reason } => {
            let (record, values) =
                (study.records[record as usize].name.clone(), values(job).unwrap_or_default());
            RunError::NoAnswer { particle: particle as usize, record, values, reason }
        }
        other => other.into(),
    }
}
