//! What a command asks of its fleet, checked.
//!
//! Next file to read: [`super::entrance`].

use std::net::SocketAddr;
use std::path::PathBuf;

use starlings_coordinator::fleet::{PlaceName, RunIdentity, StateStore};
use starlings_traces::Target;

/// What was asked for, checked.
pub(crate) struct Plan {
    /// Where to listen; `None` for local workers, which have their connections from this process.
    pub(super) address: Option<SocketAddr>,
    /// The name of the host to listen on, where it was given by name.
    pub(super) host: Option<String>,
    /// Where the access file goes; `None` without one.
    pub(super) access: Option<AccessPlan>,
    /// Where metrics are served.
    pub(super) metrics: Option<SocketAddr>,
    /// Where the live page is served.
    pub(super) dashboard: Option<SocketAddr>,
    /// Where spans go.
    pub(super) traces: Option<Target>,
    /// Workers to start where it does not listen.
    pub(super) n_worker: usize,
    /// Whether results of workers may differ.
    pub(super) mixed: bool,
    /// Bytes for large states.
    pub(super) state_memory: usize,
    /// The folder for large states that machines share.
    pub(super) states: Option<PlaceName>,
    /// Whether what is in it is needed to go on.
    pub(super) keeps_states: bool,
}

/// Where an access file goes.
pub(super) enum AccessPlan {
    /// Where the command line says.
    Named(PathBuf),
    /// Into the run folder, which may be made later: its path there, where the folder was named.
    RunFolder(Option<PathBuf>),
}

/// Name of the access file in a run folder.
pub(super) const ACCESS: &str = "access.json";

impl Plan {
    /// The same for a command that goes on from the states that it left in the shared folder.
    pub(crate) fn keeping_states(self) -> Self {
        Self { keeps_states: true, ..self }
    }

    /// The folder for large states that machines share, as it is named here.
    pub(crate) fn place(&self) -> Option<String> {
        self.states.as_ref().map(ToString::to_string)
    }

    /// Where large states of a run are kept.
    pub(super) fn store(&self, run: &RunIdentity) -> StateStore {
        match &self.states {
            None => StateStore::new(self.state_memory),
            Some(place) if self.keeps_states => StateStore::shared(place.of_run(&run.id)),
            Some(place) => StateStore::shared(place.of_run(&run.id).passing()),
        }
    }

    /// What a worker elsewhere is given to share the folder.
    pub(super) fn states_option(&self) -> String {
        let quoted = |place: &PlaceName| format!(" --states {}", shell_words::quote(&place.to_string()));
        self.states.as_ref().map(quoted).unwrap_or_default()
    }
}
