//! Why a batch ended, for its caller.

use std::net::SocketAddr;

use super::FleetError;
use super::dispatcher::BatchError;

/// Where workers can connect.
#[derive(Clone)]
pub(super) struct Listening {
    /// Nowhere where there is none.
    pub(super) address: Option<SocketAddr>,
    /// Whether nobody has to prove anything.
    pub(super) is_open: bool,
    /// How workers are started.
    pub(super) start: Option<String>,
    /// Who was refused, in words.
    pub(super) refused: Option<String>,
}

/// The error of a fleet.
pub(super) fn explained(error: BatchError, listening: Listening) -> FleetError {
    let Listening { address, is_open, start, refused } = listening;
    match error {
        BatchError::Cancelled => FleetError::Cancelled,
        BatchError::NoWorkers { waited, missing } => {
            let missing = [Some(missing), refused].into_iter().flatten().collect::<Vec<_>>().join("; ");
            FleetError::NoWorkers { address, is_open, start, waited: waited.as_secs_f64(), missing }
        }
        BatchError::SetupFailed { reason } => FleetError::SetupFailed { reason },
        BatchError::LocalWorkers(reason) => FleetError::LocalWorkers(reason),
        BatchError::Stopped(reason) => FleetError::Stopped(reason),
        BatchError::State(reason) => FleetError::State(reason),
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
