//! What the supervisor of local workers may do with their fleet.
//!
//! Next file to read: [`super::local_workers`].

use std::os::unix::net::UnixStream;
use std::sync::Arc;

use starlings_proto::descriptors::DescriptorSender;
use tokio::sync::mpsc::UnboundedSender;

use super::dispatcher::Event;
use super::hub::Hub;
use super::{FleetEvent, Load};

/// The ways to a worker that this process started, of which it holds the other ends.
pub(super) struct Adopted {
    pub(super) connection: UnixStream,
    /// That of descriptors, where the system gave one.
    pub(super) descriptors: Option<DescriptorSender>,
}

/// Lets the supervisor of local workers end a fleet's wait.
#[derive(Clone)]
pub struct FleetHandle {
    hub: Arc<Hub>,
    adopted: UnboundedSender<Adopted>,
}

impl FleetHandle {
    pub(super) fn new(hub: Arc<Hub>, adopted: UnboundedSender<Adopted>) -> Self {
        Self { hub, adopted }
    }

    /// Says that the local workers are given up: a batch without other workers ends with this reason.
    pub(crate) fn give_up(&self, reason: String) {
        self.hub.give_up(reason);
    }

    /// Says that all workers are processes of this machine: a setup that they cannot build ends a batch at once.
    pub fn local_only(&self) {
        self.hub.states().lends();
        self.hub.handle(Event::LocalOnly);
    }

    /// How much work there is, and who makes it.
    pub fn load(&self) -> Load {
        self.hub.load()
    }

    /// Tells workers, when they are asked to leave, that the run is not done.
    pub fn break_off(&self) {
        self.hub.break_off();
    }

    /// How many workers may be lost under one job.
    pub(crate) fn max_attempts(&self) -> u32 {
        self.hub.max_attempts()
    }

    /// Asks the workers with these process numbers to leave.
    pub(crate) fn dismiss(&self, pids: &[u32]) {
        self.hub.dismiss(pids);
    }

    /// Takes these ends of pairs of sockets, of which a process that this one started holds the others, as the ways to a worker.
    pub(crate) fn adopt(&self, connection: UnixStream, descriptors: Option<DescriptorSender>) {
        // A network that ended has told why.
        let _ = self.adopted.send(Adopted { connection, descriptors });
    }

    /// Passes an event on.
    pub(crate) fn tell(&self, event: FleetEvent) {
        self.hub.tell(event);
    }
}
