//! What a command asks of its fleet, checked, and what it takes before it writes anything.

use std::net::SocketAddr;
use std::path::PathBuf;

use starlings_coordinator::fleet::access::{Access, AccessFault};
use starlings_coordinator::fleet::{Bound, PlaceName, RunIdentity, StateStore};

use crate::failure::Failure;

/// What was asked for, checked.
pub(crate) struct Plan {
    /// Where to listen; `None` for local workers, which have their connections from this process.
    pub(super) address: Option<SocketAddr>,
    /// The name of the host to listen on, where it was given by name.
    pub(super) host: Option<String>,
    /// Where the access file goes; `None` without one.
    pub(super) access: Option<AccessPlan>,
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
    /// Here.
    File(PathBuf),
    /// Into the run folder, which is made later.
    RunFolder,
}

/// Name of the access file in a run folder.
pub(super) const ACCESS: &str = "access.json";

/// What a command takes before it writes anything: an address or an access file in use must leave nothing behind.
pub(crate) struct Entrance {
    pub(super) bound: Option<Bound>,
    pub(super) access: Option<Access>,
}

impl Plan {
    /// The same for a command that goes on from the states that it left in the shared folder.
    pub(crate) fn keeping_states(self) -> Self {
        Self { keeps_states: true, ..self }
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

    /// Takes the address and the secrets of the access file.
    pub(crate) fn enter(&self) -> Result<Entrance, Failure> {
        let bound = self.address.map(Bound::new).transpose().map_err(Failure::run)?;
        let file = match &self.access {
            None => return Ok(Entrance { bound, access: None }),
            Some(AccessPlan::File(file)) => Some(file.as_path()),
            Some(AccessPlan::RunFolder) => None,
        };
        let access = Access::at(file).map_err(|fault| failed(&fault))?;
        Ok(Entrance { bound, access: Some(access) })
    }
}

pub(super) fn failed(fault: &AccessFault) -> Failure {
    if fault.is_input() { Failure::input(format!("--access: {fault}")) } else { Failure::run(fault) }
}
