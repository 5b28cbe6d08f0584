//! What an event is about, and whom it concerns: its kind, its worker, its run, who should see it.
//!
//! Next file to read: `event_text.rs`.

use super::FleetEvent;

/// Why workers leave at the end.
pub(super) const OVER: &str = "the run is over";

/// What a coordinator says to its workers that ends before its run is done.
pub(super) const BROKEN_OFF: &str = "the command broke off before it was done, and may be started again, with --resume where that is possible";

impl FleetEvent {
    /// A short name of the kind of event.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Listening { .. } => "listening",
            Self::WorkerJoined { .. } => "worker-joined",
            Self::OtherBuild { .. } => "other-build",
            Self::SharesStates { .. } => "shares-states",
            Self::WorkerRefused { .. } => "worker-refused",
            Self::CallerRefused { .. } => "caller-refused",
            Self::WorkerLeft { .. } => "worker-left",
            Self::SetupFailed { .. } => "setup-failed",
            Self::WorkerSetAside { .. } => "worker-set-aside",
            Self::WorkerBack { .. } => "worker-back",
            Self::ControlRun { .. } => "control-run",
            Self::JobRetried { .. } => "job-retried",
            Self::JobFailed { .. } => "job-failed",
            Self::RunsBrought { .. } => "runs-brought",
            Self::WorkerExcluded { .. } => "worker-excluded",
            Self::WorkersDiffer { .. } => "workers-differ",
            Self::NotReproducible { .. } => "not-reproducible",
            Self::JobDuplicated { .. } => "job-duplicated",
            Self::Untold { .. } => "untold",
            Self::LateAnswer { .. } => "late-answer",
            Self::Waiting { .. } => "waiting",
            Self::Progress { .. } => "progress",
            Self::LocalWorkerRestarted { .. } => "worker-restarted",
            Self::LocalWorkerGivenUp { .. } => "worker-given-up",
        }
    }

    /// The worker that it is about, by its name.
    pub fn worker(&self) -> Option<&str> {
        match self {
            Self::WorkerJoined { worker, .. }
            | Self::OtherBuild { worker, .. }
            | Self::SharesStates { worker }
            | Self::WorkerLeft { worker, .. }
            | Self::SetupFailed { worker, .. }
            | Self::WorkerSetAside { worker, .. }
            | Self::WorkerBack { worker }
            | Self::ControlRun { worker, .. }
            | Self::JobRetried { worker, .. }
            | Self::RunsBrought { worker, .. }
            | Self::WorkerExcluded { worker, .. }
            | Self::JobDuplicated { worker, .. }
            | Self::LateAnswer { worker, .. } => Some(worker),
            _ => None,
        }
    }

    /// The run of the model that it is about: index of the sigma point, and of the record.
    pub fn job(&self) -> Option<(u32, u32)> {
        match *self {
            Self::ControlRun { particle, record, .. }
            | Self::JobRetried { particle, record, .. }
            | Self::JobFailed { particle, record, .. }
            | Self::JobDuplicated { particle, record, .. } => Some((particle, record)),
            _ => None,
        }
    }

    /// Whether somebody who watches the run should see it at once.
    pub fn is_notable(&self) -> bool {
        matches!(
            self,
            Self::WorkerRefused { .. }
                | Self::CallerRefused { .. }
                | Self::OtherBuild { .. }
                | Self::SetupFailed { .. }
                | Self::RunsBrought { .. }
                | Self::WorkerSetAside { .. }
                | Self::JobFailed { .. }
                | Self::WorkerExcluded { .. }
                | Self::WorkersDiffer { .. }
                | Self::NotReproducible { .. }
                | Self::Untold { .. }
                | Self::Waiting { .. }
                | Self::LocalWorkerRestarted { .. }
                | Self::LocalWorkerGivenUp { .. }
        )
    }

    /// Whether somebody who started workers elsewhere should see it: who came, who went, who is used again.
    pub fn is_of_roster(&self) -> bool {
        match self {
            Self::WorkerJoined { .. } | Self::SharesStates { .. } | Self::WorkerBack { .. } => true,
            Self::WorkerLeft { reason, .. } => reason != OVER && reason != BROKEN_OFF,
            _ => false,
        }
    }

    /// Whether the event belongs into the run's record; progress is only for the moment.
    pub fn is_lasting(&self) -> bool {
        !matches!(self, Self::Progress { .. })
    }
}
