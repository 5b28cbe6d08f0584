//! The faults: what happens, how long it lasts, and at which run of the study.
//!
//! Next file to read: [`super::study_folder`].

/// The command whose study is disturbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Verb {
    Run,
    Explain,
}

/// How the solver is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Reached {
    /// A program in C, started for every run.
    Command,
    /// The Python package behind `solver.proto`.
    Grpc,
    /// The same on two MPI ranks.
    Mpi,
}

/// How long a fault lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lasts {
    /// One run meets it.
    Once,
    /// Every run from then on, until it is repaired.
    UntilRepaired,
}

/// What must come of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Must {
    /// The undisturbed result, at once.
    GoOn,
    /// An error, and the undisturbed result after repair and resume.
    Stop,
    /// Either of them.
    Either,
}

/// A kind of fault.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fault {
    /// Name in the solver's plan.
    pub(crate) kind: &'static str,
    pub(crate) lasts: Lasts,
    pub(crate) must: Must,
    /// Words of which an error holds at least one.
    pub(crate) causes: &'static [&'static str],
    /// What happens, for people.
    pub(crate) says: &'static str,
}

/// A fault in a study.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) seed: u64,
    pub(crate) verb: Verb,
    pub(crate) reached: Reached,
    pub(crate) fault: Fault,
}

const GONE: &[&str] = &["No such file or directory", "scratch", "No such", "no such program"];
const KILLED: &[&str] = &["signal 9", "killed"];
const SILENT: &[&str] = &["stopped", "did not answer within", "did not end within", "paused"];
const WORKER: &[&str] = &["waited", "worker"];
const REPLACED: &[&str] = &["cannot read its mesh"];
const LICENCE: &[&str] = &["no free seat"];
const FULL: &[&str] = &["No space left on device"];

const fn fault(
    kind: &'static str,
    lasts: Lasts,
    must: Must,
    causes: &'static [&'static str],
    says: &'static str,
) -> Fault {
    Fault { kind, lasts, must, causes, says }
}

use Lasts::{Once, UntilRepaired};
use Must::{Either, GoOn, Stop};

/// Faults that take no time of their own.
const QUICK: [Fault; 12] = [
    fault("scratch", Once, GoOn, GONE, "the scratch root is removed, once"),
    fault("scratch", UntilRepaired, Either, GONE, "the scratch root is removed again and again"),
    fault("full", Once, GoOn, FULL, "the disk is full for one run"),
    fault("full", UntilRepaired, Stop, FULL, "the disk of the results is full"),
    fault("licence", Once, GoOn, LICENCE, "the licence is refused for one run"),
    fault("licence", UntilRepaired, Stop, LICENCE, "the licence is refused from then on"),
    fault("replaced", Once, Either, REPLACED, "the program is replaced by one that fails"),
    fault("removed", Once, Either, GONE, "the program is removed"),
    fault("killed", Once, GoOn, KILLED, "one run is killed, as for memory"),
    fault("killed", UntilRepaired, Stop, KILLED, "every run is killed, as for memory"),
    fault("paused", Once, GoOn, SILENT, "the solver is stopped and goes on"),
    fault("worker-killed", Once, GoOn, WORKER, "a worker is killed"),
];

/// Faults that a wall-clock limit ends.
const SLOW: [Fault; 2] = [
    fault("stopped", Once, Either, SILENT, "the solver is stopped for ever"),
    fault("worker-stopped", Once, GoOn, WORKER, "a worker is stopped for ever"),
];

/// Only where the solver serves a socket.
const SOCKET: Fault = fault("socket", Once, GoOn, GONE, "the solver's socket and then the solver are gone");

/// The faults of the fast test: those of a program in C, one moment each.
pub(crate) fn few() -> Vec<Case> {
    cases(Reached::Command, &QUICK, 1)
}

/// The faults of the whole battery.
pub(crate) fn all() -> Vec<Case> {
    // Behind a launcher the parent of the solver is no worker.
    let behind = QUICK.iter().filter(|fault| !fault.kind.starts_with("worker")).copied().collect::<Vec<_>>();
    let mut all = cases(Reached::Command, &QUICK, 5);
    all.extend(cases(Reached::Command, &SLOW, 2));
    all.extend(cases(Reached::Grpc, &QUICK, 2));
    all.extend(cases(Reached::Grpc, &[SOCKET], 2));
    all.extend(cases(Reached::Grpc, &SLOW, 1));
    all.extend(cases(Reached::Mpi, &behind, 1));
    all.extend(cases(Reached::Mpi, &[SOCKET, SLOW[0]], 1));
    all
}

fn cases(reached: Reached, faults: &[Fault], moments: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for (number, fault) in faults.iter().enumerate() {
        for verb in [Verb::Run, Verb::Explain] {
            for moment in 0..moments {
                let seed = 1000 * moment + 100 * (reached as u64) + 10 * (verb as u64) + number as u64;
                cases.push(Case { seed, verb, reached, fault: *fault });
            }
        }
    }
    cases
}

/// Runs of the trial by which a command checks its study: the whole record, and the training span.
const TRIAL: u64 = 2;

impl Case {
    /// The first run that meets the fault and the last, of a study that takes `n_run` runs. The trial is not disturbed: it is made
    /// by the command itself, before there is anything to resume.
    pub(crate) fn runs(&self, n_run: u64) -> (u64, u64) {
        // SplitMix64 (Steele, Lea & Flood 2014).
        let mut z = self.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let first = TRIAL + 1 + (z ^ (z >> 31)) % (n_run - TRIAL);
        (first, if self.fault.lasts == Lasts::Once { first } else { u64::from(u32::MAX) })
    }

    /// What it is called in messages.
    pub(crate) fn name(&self) -> String {
        format!(
            "{:?} {:?} {} ({:?}, seed {})",
            self.verb, self.reached, self.fault.kind, self.fault.lasts, self.seed
        )
    }
}
