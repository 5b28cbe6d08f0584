//! Workers set aside: their place cannot make runs now, so they get none for a while, then one to try, and jobs as before when it works.
//!
//! What a place cannot do counts no attempt of a job. When no other worker is left, patience ends the batch: see [`super::watch`].

use std::time::Duration;

use super::Dispatcher;
use super::message::{Command, WorkerId};
use super::roster::Worker;
use crate::FleetEvent;

/// How long a worker is set aside at first; doubled each time that it fails again, up to [`LONGEST`].
const FIRST: Duration = Duration::from_millis(500);
const LONGEST: Duration = Duration::from_secs(30);

/// Why a worker gets no jobs, and until when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Aside {
    pub(super) reason: String,
    until: Duration,
    pause: Duration,
    /// Whether it may be tried with one job.
    pub(super) is_due: bool,
}

impl Aside {
    /// What becomes of a worker that fails, after what it was `before`: nothing new while that lasts, since failures of jobs that
    /// it had before do not count again.
    fn after(before: Option<&Self>, now: Duration, reason: &str) -> Option<Self> {
        let pause = match before {
            None => FIRST,
            Some(aside) if aside.is_due => (aside.pause * 2).min(LONGEST),
            Some(_) => return None,
        };
        Some(Self { reason: reason.to_owned(), until: now + pause, pause, is_due: false })
    }

    /// Takes note of the time: one that has waited long enough may be tried.
    pub(super) fn look_again(&mut self, now: Duration) {
        self.is_due |= self.until <= now;
    }
}

impl Dispatcher {
    /// The place of a worker cannot make runs: what waits there comes back.
    pub(super) fn set_aside(&mut self, now: Duration, id: WorkerId, reason: &str) {
        let Some(mut worker) = self.workers.get_mut(id) else { return };
        let Some(aside) = Aside::after(worker.aside.as_ref(), now, reason) else { return };
        let (name, seconds) = (worker.name.clone(), aside.pause.as_secs_f64());
        worker.aside = Some(aside);
        let notice = FleetEvent::WorkerSetAside { worker: name, reason: reason.to_owned(), seconds };
        self.out.push(Command::Notice(notice));
        let leases = worker.call_back_all();
        if !leases.is_empty() {
            self.out.push(Command::Cancel { worker: id, leases, stop: false });
        }
    }

    /// A run was made by a worker: if it was set aside, it is no longer.
    pub(super) fn works(&mut self, id: WorkerId) {
        // Asked after every run, and mostly nothing changes that an index would have to follow.
        let is_tried = |worker: &&Worker| worker.aside.as_ref().is_some_and(|aside| aside.is_due);
        let Some(worker) = self.workers.get(id).filter(is_tried) else { return };
        self.out.push(Command::Notice(FleetEvent::WorkerBack { worker: worker.name.clone() }));
        if let Some(mut worker) = self.workers.get_mut(id) {
            worker.aside = None;
        }
    }
}
