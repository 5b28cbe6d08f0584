//! Workers set aside: their place cannot make runs now, so they get none for a while, then one to try, and all again when it works.
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

impl Worker {
    /// Sets it aside; for how long. Failures of jobs that it had before do not count again.
    fn put_aside(&mut self, now: Duration, reason: &str) -> Option<Duration> {
        let pause = match &self.aside {
            None => FIRST,
            Some(aside) if aside.is_due => (aside.pause * 2).min(LONGEST),
            Some(_) => return None,
        };
        self.aside = Some(Aside { reason: reason.to_owned(), until: now + pause, pause, is_due: false });
        Some(pause)
    }

    /// Takes note of the time: one that has waited long enough may be tried.
    pub(super) fn look_again(&mut self, now: Duration) {
        if let Some(aside) = self.aside.as_mut().filter(|aside| aside.until <= now) {
            aside.is_due = true;
        }
    }
}

impl Dispatcher {
    /// The place of a worker cannot make runs: what waits there comes back.
    pub(super) fn set_aside(&mut self, now: Duration, id: WorkerId, reason: &str) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let Some(pause) = worker.put_aside(now, reason) else { return };
        let (name, seconds) = (worker.name.clone(), pause.as_secs_f64());
        let notice = FleetEvent::WorkerSetAside { worker: name, reason: reason.to_owned(), seconds };
        self.out.push(Command::Notice(notice));
        let leases: Vec<_> = worker.leases().collect();
        if !leases.is_empty() {
            self.out.push(Command::Cancel { worker: id, leases });
        }
    }

    /// A run was made by a worker: if it was set aside, it is no longer.
    pub(super) fn works(&mut self, id: WorkerId) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        if worker.aside.take_if(|aside| aside.is_due).is_some() {
            self.out.push(Command::Notice(FleetEvent::WorkerBack { worker: worker.name.clone() }));
        }
    }
}
