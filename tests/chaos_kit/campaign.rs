//! One study from its start to its posterior, disturbed all the way.
//!
//! Next files to read: [`super::inject`] for what a fault does, [`super::ending`] for what is asked in the end.

use std::collections::HashSet;
use std::net::{SocketAddr, TcpListener};
use std::time::{Duration, Instant};

use rustix::process::Signal;

use super::judge;
use super::namespaces::{self, Disk};
use super::plan::{Fault, Kind, May, plan};
use super::solvers::signal;
use super::studies::Sort;
use super::workers::{Seat, Way, furnished};
use crate::access_kit::Started;
use crate::common::starlings;
use crate::fault_kit::processes;
use crate::fault_kit::study_folder::StudyFolder;

/// The longest that a campaign may take; beyond it hangs, which is an error.
pub(super) const LIMIT: Duration = Duration::from_secs(420);

/// What a coordinator says when its access file is written.
const LISTENS: &str = "listening on ";

/// A fault that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Done {
    pub(crate) kind: Kind,
    /// Whether it outlasted the limit of silence.
    pub(crate) long: bool,
}

/// What ends a fault that lasts.
pub(crate) enum Undo {
    Continue(u32),
    Pass(usize),
    Up(usize),
    Clear,
}

pub(crate) struct Pending {
    pub(crate) from: Instant,
    pub(crate) until: Instant,
    pub(crate) kind: Kind,
    pub(crate) undo: Undo,
}

/// A study that is disturbed.
pub(crate) struct Campaign {
    pub(crate) sort: Sort,
    pub(crate) place: StudyFolder,
    pub(crate) address: SocketAddr,
    pub(crate) coordinator: Started,
    /// What earlier coordinators said.
    pub(crate) said: String,
    pub(crate) seats: Vec<Seat>,
    pub(crate) pending: Vec<Pending>,
    pub(crate) acknowledged: HashSet<u64>,
    /// Parameters with which a solver was disturbed.
    pub(crate) met: HashSet<String>,
    pub(crate) done: Vec<Done>,
    pub(crate) over: bool,
    pub(crate) folder: Option<Disk>,
    pub(crate) scratch: Option<Disk>,
    /// Since the coordinator started, which may end with an error then.
    pub(crate) scratch_was_full: bool,
    started: Instant,
}

/// Makes the campaign of a seed: the faults that happened, and how many runs were acknowledged and in no analysis yet when a
/// coordinator ended.
///
/// # Errors
/// When anything else comes of it than the undisturbed posterior.
pub(crate) fn make(seed: u64, sort: Sort, may: May) -> Result<(Vec<Done>, usize), String> {
    let clean = sort.clean();
    let faults = plan(seed, sort, clean.n_run, may);
    let mut campaign = Campaign::start(sort);
    let judged = campaign.disturb(&faults).and_then(|()| campaign.finish(&clean));
    processes::end(&campaign.place.mark());
    match judged {
        Ok(()) => Ok((campaign.done, campaign.acknowledged.len())),
        Err(fault) => Err(campaign.report(seed, &faults, &fault)),
    }
}

impl Campaign {
    fn start(sort: Sort) -> Self {
        let place = sort.place();
        let disk = |name, mib| namespaces::inside().then(|| Disk::at(&place.path(name), mib));
        let (folder, scratch) = (disk("out", 160), disk("scratch", 64));
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let coordinator = coordinator(sort, &place, address, &[]);
        coordinator.await_words(LISTENS);
        // The first and the last one make a run at a time, the second one two.
        let ways = Way::all(address).into_iter().enumerate();
        let seats = ways.map(|(i, way)| Seat::new(way, 1 + i % 2, sort, &place, address)).collect();
        Self {
            sort,
            place,
            address,
            coordinator,
            said: String::new(),
            seats,
            pending: Vec::new(),
            acknowledged: HashSet::new(),
            met: HashSet::new(),
            done: Vec::new(),
            over: false,
            folder,
            scratch,
            scratch_was_full: false,
            started: Instant::now(),
        }
    }

    fn disturb(&mut self, faults: &[Fault]) -> Result<(), String> {
        for fault in faults {
            while !self.over && judge::progress(&self.place.out()) < fault.at {
                self.wait()?;
            }
            if self.over {
                break;
            }
            self.inject(fault)?;
        }
        while !self.over {
            self.wait()?;
        }
        Ok(())
    }

    /// A moment, in which faults end and ends are seen.
    pub(crate) fn wait(&mut self) -> Result<(), String> {
        std::thread::sleep(Duration::from_millis(5));
        if self.started.elapsed() > LIMIT {
            return Err(format!("it hangs: not over after {} s", LIMIT.as_secs()));
        }
        self.undo_until(Instant::now());
        if let Some(status) = self.coordinator.child.try_wait().unwrap() {
            if self.scratch_was_full && !status.success() {
                return self.take_error(status);
            }
            self.over = true;
            return if status.success() {
                Ok(())
            } else {
                Err(format!("the coordinator ended with {status}"))
            };
        }
        for number in 0..self.seats.len() {
            let seat = &mut self.seats[number];
            let Some(status) = seat.worker.child.try_wait().unwrap() else { continue };
            if seat.may_end {
                if !self.coordinator.said().contains(LISTENS) {
                    continue;
                }
                seat.renew(self.sort, &self.place, self.address);
            } else if !self.ends_now() {
                return Err(format!("worker {number} ended with {status} while its run goes on"));
            }
        }
        Ok(())
    }

    /// Whether the coordinator ends in a moment, as it does after its workers.
    fn ends_now(&mut self) -> bool {
        let seen = Instant::now();
        while self.coordinator.child.try_wait().unwrap().is_none() {
            if seen.elapsed() > Duration::from_secs(20) {
                return false;
            }
            self.undo_until(Instant::now());
            std::thread::sleep(Duration::from_millis(5));
        }
        true
    }

    /// Ends the faults that are due.
    pub(crate) fn undo_until(&mut self, now: Instant) {
        for pending in self.pending.extract_if(.., |pending| pending.until <= now).collect::<Vec<_>>() {
            match pending.undo {
                Undo::Continue(pid) => {
                    signal(pid, Signal::CONT);
                }
                Undo::Pass(seat) => {
                    if let Way::Proxy(proxy) = &self.seats[seat].way {
                        proxy.hold(false);
                    }
                }
                Undo::Up(seat) => {
                    if let Way::Link(link) = &self.seats[seat].way {
                        link.set(true);
                    }
                }
                Undo::Clear => self.scratch.as_ref().unwrap().clear(),
            }
            let lasted = pending.from.elapsed();
            let long = pending.kind.silence().is_some_and(|silence| lasted >= silence);
            self.done.push(Done { kind: pending.kind, long });
        }
    }

    /// Starts the coordinator again, from what its folder holds where there is a run in it, and waits until it listens.
    pub(crate) fn resume(&mut self) -> Result<(), String> {
        let pid = self.coordinator.child.id();
        self.pending.retain(|pending| !matches!(pending.undo, Undo::Continue(of) if of == pid));
        let is_begun = self.place.out().join("run.db").exists();
        if is_begun {
            let acknowledged = judge::acknowledged(&self.place.out());
            self.acknowledged.extend(acknowledged.map_err(|error| format!("the store is damaged: {error}"))?);
        }
        let resume: &[&str] = if is_begun { &["--resume"] } else { &[] };
        self.said = format!("{}{}-- resumed --\n", self.said, self.coordinator.said());
        self.scratch_was_full = self.pending.iter().any(|pending| matches!(pending.undo, Undo::Clear));
        self.coordinator = coordinator(self.sort, &self.place, self.address, resume);
        while !self.over && !self.coordinator.said().contains(LISTENS) {
            self.wait()?;
        }
        Ok(())
    }
}

fn coordinator(sort: Sort, place: &StudyFolder, address: SocketAddr, more: &[&str]) -> Started {
    let mut command = starlings();
    command.args(["-v", "run"]).arg(place.study()).arg("--out").arg(place.out());
    command.args(["--listen", &format!("0.0.0.0:{}", address.port())]).args(sort.options()).args(more);
    furnished(&mut command, sort, place)
}
