//! Why a batch ended, for its caller.

use std::net::SocketAddr;

use super::FleetError;
use super::dispatcher::BatchError;

/// The error of a fleet on which workers can connect at this address, if anywhere.
pub(super) fn explained(error: BatchError, address: Option<SocketAddr>) -> FleetError {
    match error {
        BatchError::Cancelled => FleetError::Cancelled,
        BatchError::NoWorkers { waited, missing } => {
            FleetError::NoWorkers { address, waited: waited.as_secs_f64(), missing }
        }
        BatchError::SetupFailed { reason } => FleetError::SetupFailed { reason },
        BatchError::LocalWorkers(reason) => FleetError::LocalWorkers(reason),
        BatchError::Stopped(reason) => FleetError::Stopped(reason),
        BatchError::Unavailable { waited, reasons } => {
            FleetError::Unavailable { waited: waited.as_secs_f64(), reasons }
        }
        BatchError::NoControl { particle, record, parameters, reason, .. } => {
            FleetError::NoControl { particle, record, parameters, reason }
        }
        BatchError::Disagreement { particle, record, workers } => {
            FleetError::Disagreement { particle, record, workers }
        }
        BatchError::NoAnswer { index, particle, record, reason } => {
            FleetError::NoAnswer { job: index, particle, record, reason }
        }
    }
}
