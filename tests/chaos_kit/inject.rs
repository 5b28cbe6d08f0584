//! What every kind of fault does.

use std::process::ExitStatus;
use std::time::{Duration, Instant};

use rustix::process::Signal;

use super::campaign::{Campaign, Done, Pending, Undo};
use super::plan::{Fault, Kind};
use super::proxy::Damage;
use super::solvers::{self, signal};
use super::workers::Way;
use crate::common::kill;

/// The longest that a coordinator may take to see that its disk is full.
const SEEN: Duration = Duration::from_secs(90);

/// Words of which an error of a full disk has at least one.
const FULL: [&str; 3] = ["disk is full", "disk failed or is full", "No space left"];

/// What an error says to do when the disk has room again: go on, write the files of a run that is done, or begin it.
const THEN: [&str; 3] =
    ["--resume", "`starlings report`", "nothing was begun: see that it has space and start again"];

impl Campaign {
    /// Lets a fault happen.
    pub(crate) fn inject(&mut self, fault: &Fault) -> Result<(), String> {
        let seats: Vec<usize> = if fault.all { (0..self.seats.len()).collect() } else { vec![fault.worker] };
        match fault.kind {
            Kind::WorkerKilled => self.kill_worker(fault.worker),
            Kind::WorkerStopped => {
                for seat in seats {
                    self.stop(self.seats[seat].pid(), fault);
                }
            }
            Kind::CoordinatorStopped => self.stop(self.coordinator.child.id(), fault),
            Kind::CoordinatorKilled => {
                kill(&mut self.coordinator.child);
                self.did(fault.kind);
                self.resume()?;
            }
            Kind::SolverKilled | Kind::SolverPaused | Kind::SolverStopped => self.meet_solver(fault)?,
            Kind::LinkHeld | Kind::LinkDown => seats.into_iter().for_each(|seat| self.silence(seat, fault)),
            Kind::LinkCut => self.cut(fault.worker),
            Kind::FrameFlipped => self.damage(fault, Damage::Flip),
            Kind::FrameShortened => self.damage(fault, Damage::Shorten),
            Kind::FrameLengthened => self.damage(fault, Damage::Lengthen),
            Kind::FolderFull => self.fill_folder()?,
            Kind::ScratchFull => {
                if !self.pending.iter().any(|pending| matches!(pending.undo, Undo::Clear)) {
                    self.scratch.as_ref().unwrap().fill();
                    self.scratch_was_full = true;
                    self.lasting(fault, Undo::Clear);
                }
            }
        }
        Ok(())
    }

    fn did(&mut self, kind: Kind) {
        self.done.push(Done { kind, long: false });
    }

    fn lasting(&mut self, fault: &Fault, undo: Undo) {
        let from = Instant::now();
        self.pending.push(Pending { from, until: from + fault.lasts, kind: fault.kind, undo });
    }

    fn stop(&mut self, pid: u32, fault: &Fault) {
        let is_stopped = |pending: &Pending| matches!(pending.undo, Undo::Continue(of) if of == pid);
        if !self.pending.iter().any(is_stopped) && signal(pid, Signal::STOP) {
            self.lasting(fault, Undo::Continue(pid));
        }
    }

    fn kill_worker(&mut self, number: usize) {
        let seat = &mut self.seats[number];
        if seat.worker.child.try_wait().unwrap().is_some() {
            return;
        }
        let pid = seat.pid();
        kill(&mut seat.worker.child);
        seat.renew(self.sort, &self.place, self.address);
        self.pending.retain(|pending| !matches!(pending.undo, Undo::Continue(of) if of == pid));
        self.did(Kind::WorkerKilled);
    }

    fn meet_solver(&mut self, fault: &Fault) -> Result<(), String> {
        let started = Instant::now();
        while !self.over && started.elapsed() < Duration::from_secs(3) {
            if let Some(pid) = solvers::stop_one(&self.place, &mut self.met) {
                match fault.kind {
                    Kind::SolverKilled => {
                        signal(pid, Signal::KILL);
                        self.did(fault.kind);
                    }
                    Kind::SolverPaused => self.lasting(fault, Undo::Continue(pid)),
                    _ => self.did(fault.kind),
                }
                return Ok(());
            }
            self.wait()?;
        }
        Ok(())
    }

    fn silence(&mut self, number: usize, fault: &Fault) {
        let is_silent =
            |pending: &Pending| matches!(pending.undo, Undo::Pass(of) | Undo::Up(of) if of == number);
        if self.pending.iter().any(is_silent) {
            return;
        }
        // What a seat has is held up or goes down, whichever was drawn.
        let (kind, undo) = match &self.seats[number].way {
            Way::Proxy(proxy) => {
                proxy.hold(true);
                (Kind::LinkHeld, Undo::Pass(number))
            }
            Way::Link(link) => {
                link.set(false);
                (Kind::LinkDown, Undo::Up(number))
            }
        };
        self.lasting(&Fault { kind, ..fault.clone() }, undo);
    }

    fn cut(&mut self, number: usize) {
        // A link is not cut but goes down: the connections of another worker are.
        let seats = (0..self.seats.len()).map(|more| (number + more) % self.seats.len());
        for seat in seats {
            if let Way::Proxy(proxy) = &self.seats[seat].way {
                proxy.cut();
                return self.did(Kind::LinkCut);
            }
        }
    }

    fn damage(&mut self, fault: &Fault, damage: Damage) {
        let seats = (0..self.seats.len()).map(|more| (fault.worker + more) % self.seats.len());
        for seat in seats {
            if let Way::Proxy(proxy) = &self.seats[seat].way {
                if proxy.damage(damage, fault.draw.clone()) {
                    self.did(fault.kind);
                }
                return;
            }
        }
    }

    fn fill_folder(&mut self) -> Result<(), String> {
        let coordinator = self.coordinator.child.id();
        let of_it = |pending: &Pending| matches!(pending.undo, Undo::Continue(of) if of == coordinator);
        for pending in self.pending.iter_mut().filter(|pending| of_it(pending)) {
            pending.until = Instant::now();
        }
        self.undo_until(Instant::now());
        self.folder.as_ref().unwrap().fill();
        let started = Instant::now();
        let status = loop {
            if let Some(status) = self.coordinator.child.try_wait().unwrap() {
                break status;
            }
            if started.elapsed() > SEEN {
                return Err(format!(
                    "the disk is full for {} s, and the coordinator goes on",
                    SEEN.as_secs()
                ));
            }
            self.undo_until(Instant::now());
            std::thread::sleep(Duration::from_millis(5));
        };
        self.folder.as_ref().unwrap().clear();
        self.did(Kind::FolderFull);
        if status.success() {
            self.over = true;
            return Ok(());
        }
        self.take_error(status)
    }

    /// Goes on after a coordinator that ended with an error because a disk was full.
    pub(crate) fn take_error(&mut self, status: ExitStatus) -> Result<(), String> {
        for pending in self.pending.iter_mut().filter(|pending| matches!(pending.undo, Undo::Clear)) {
            pending.until = Instant::now();
        }
        self.undo_until(Instant::now());
        self.scratch_was_full = false;
        // What it said is read a moment after its end.
        let has = |words: &[&str]| words.iter().any(|words| self.coordinator.said().contains(words));
        let told = |words: &[&str]| {
            (0..400).any(|_| {
                has(words) || {
                    std::thread::sleep(Duration::from_millis(5));
                    false
                }
            })
        };
        if status.code() != Some(1) || !told(&FULL) || !told(&THEN) {
            return Err(format!("a disk was full, and the coordinator ended with {status}"));
        }
        for seat in &mut self.seats {
            seat.may_end = true;
        }
        self.resume()
    }
}
