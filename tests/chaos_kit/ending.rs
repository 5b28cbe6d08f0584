//! What is asked of a study that was disturbed, and what is told where it is not so.
//!
//! Next file to read: [`super::judge`].

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use super::campaign::{Campaign, LIMIT};
use super::judge;
use super::namespaces;
use super::plan::{Fault, Kind};
use super::studies::Clean;
use super::workers::{Seat, Way};
use crate::fault_kit::judge as fault_judge;
use crate::fault_kit::study_folder::Ended;

/// The longest that a worker may stay when its run is over.
const AFTERWARDS: Duration = Duration::from_secs(150);

impl Campaign {
    /// Waits until all is over; what is wrong with it.
    pub(super) fn finish(&mut self, clean: &Clean) -> Result<(), String> {
        self.undo_until(Instant::now() + LIMIT);
        for seat in &self.seats {
            if let Way::Proxy(proxy) = &seat.way {
                let unmet = proxy.undamage();
                for _ in 0..unmet {
                    let last = self.done.iter().rposition(|done| is_damage(done.kind)).unwrap();
                    self.done.remove(last);
                }
            }
        }
        let ended = Instant::now();
        for number in 0..self.seats.len() {
            while self.seats[number].worker.child.try_wait().unwrap().is_none() {
                if ended.elapsed() > AFTERWARDS {
                    return Err(format!(
                        "worker {number} is still there {} s after the run",
                        AFTERWARDS.as_secs()
                    ));
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            let status = self.seats[number].worker.child.wait().unwrap();
            if !status.success() && !self.seats[number].came_too_late() {
                return Err(format!("worker {number} ended with {status} after the run"));
            }
        }
        self.asked(clean)
    }

    fn asked(&self, clean: &Clean) -> Result<(), String> {
        let out = self.place.out();
        if self.place.result()? != clean.posterior {
            return Err("another posterior".to_owned());
        }
        let n_run = judge::count(&out, "SELECT count(*) FROM jobs").unwrap_or(0);
        if n_run != clean.n_run {
            return Err(format!("{n_run} runs instead of {}", clean.n_run));
        }
        let lost = judge::lost(&out, &self.acknowledged).map_err(|error| error.to_string())?;
        if lost > 0 {
            return Err(format!("{lost} of {} acknowledged runs are lost", self.acknowledged.len()));
        }
        let workers: Vec<String> = self.seats.iter().map(Seat::all_said).collect();
        let stderr = format!("{}{}{}", self.said, self.coordinator.said(), workers.concat());
        fault_judge::nothing_left(&self.place, &[&Ended { code: Some(0), stderr }])
    }

    /// Everything that one needs to see why it failed.
    pub(super) fn report(&self, seed: u64, faults: &[Fault], fault: &str) -> String {
        let place = if namespaces::inside() { "in namespaces" } else { "without namespaces" };
        let planned = |f: &Fault| format!("{:?}@{}>{}/{:?} ", f.kind, f.at, f.worker, f.lasts);
        format!(
            "STARLINGS_CHAOS_SEED={seed} CHAOS_FAULTS=1 just chaos ({:?}, {place}): {fault}\nfaults so far: {:?}\nplan: {}\n{}",
            self.sort,
            self.done,
            faults.iter().map(planned).collect::<String>(),
            self.told()
        )
    }

    /// What everybody said.
    fn told(&self) -> String {
        let mut text = format!("-- coordinator --\n{}{}", last(&self.said), last(&self.coordinator.said()));
        for (number, seat) in self.seats.iter().enumerate() {
            writeln!(text, "-- worker {number} --\n{}{}", last(&seat.said), last(&seat.worker.said()))
                .unwrap();
        }
        text
    }
}

fn is_damage(kind: Kind) -> bool {
    matches!(kind, Kind::FrameFlipped | Kind::FrameShortened | Kind::FrameLengthened)
}

/// The last lines of a text.
fn last(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(40)..].join("\n") + "\n"
}
