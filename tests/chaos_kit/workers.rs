//! The places of workers: each has a way to the coordinator that can be disturbed, and a process that can be put in again.

use std::net::SocketAddr;
use std::process::Command;
use std::time::Duration;

use super::namespaces::{self, Link};
use super::proxy::Proxy;
use super::studies::{Sort, permitted};
use crate::access_kit::Started;
use crate::common::starlings;
use crate::fault_kit::study_folder::StudyFolder;

/// Workers of a campaign.
pub(crate) const N: usize = 3;

/// A way to the coordinator.
pub(crate) enum Way {
    Proxy(Proxy),
    Link(Link),
}

impl Way {
    /// The ways of all workers: the last one is a link where links can be made.
    pub(crate) fn all(coordinator: SocketAddr) -> Vec<Self> {
        let way = |number| {
            if number == N - 1 && namespaces::inside() {
                Self::Link(Link::new())
            } else {
                Self::Proxy(Proxy::to(coordinator))
            }
        };
        (0..N).map(way).collect()
    }
}

/// A worker in its place.
pub(crate) struct Seat {
    pub(crate) way: Way,
    /// Runs at a time.
    slots: usize,
    pub(crate) worker: Started,
    /// Its coordinator ended with an error, so it may have ended too.
    pub(crate) may_end: bool,
    /// What those said that were here before.
    pub(crate) said: String,
}

impl Seat {
    pub(crate) fn new(
        way: Way,
        slots: usize,
        sort: Sort,
        place: &StudyFolder,
        coordinator: SocketAddr,
    ) -> Self {
        let worker = start(&way, slots, sort, place, coordinator);
        Self { way, slots, worker, may_end: false, said: String::new() }
    }

    /// Another worker in the place of one that ended or was killed.
    pub(crate) fn renew(&mut self, sort: Sort, place: &StudyFolder, coordinator: SocketAddr) {
        self.said = format!("{}{}-- another worker --\n", self.said, self.worker.said());
        self.worker = start(&self.way, self.slots, sort, place, coordinator);
        self.may_end = false;
    }

    /// What all that were here said.
    pub(crate) fn all_said(&self) -> String {
        format!("{}{}", self.said, self.worker.said())
    }

    /// Whether a worker that has ended found that the run was over when it came.
    pub(crate) fn came_too_late(&self) -> bool {
        // What it said is read a moment after its end.
        let words = "has ended: start a coordinator";
        (0..400).any(|_| {
            std::thread::sleep(Duration::from_millis(5));
            self.worker.said().contains(words)
        })
    }

    pub(crate) fn pid(&self) -> u32 {
        self.worker.child.id()
    }
}

fn start(way: &Way, slots: usize, sort: Sort, place: &StudyFolder, coordinator: SocketAddr) -> Started {
    let own = starlings();
    let (mut command, address) = match way {
        Way::Proxy(proxy) => (own, proxy.address.to_string()),
        Way::Link(link) => {
            let mut command = link.command();
            command.arg(own.get_program());
            (command, format!("{}:{}", link.near(), coordinator.port()))
        }
    };
    command.args(["-v", "worker", "--slots", &slots.to_string(), "--connect", &address, "--access"]);
    command.arg(place.out().join("access.json"));
    if let Some(study) = permitted(sort, place) {
        command.arg("--solver-from").arg(study);
    }
    furnished(&mut command, sort, place)
}

/// Starts a process of a campaign.
pub(crate) fn furnished(command: &mut Command, sort: Sort, place: &StudyFolder) -> Started {
    sort.furnish(place, command);
    Started::of(command)
}
