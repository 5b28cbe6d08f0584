//! The faults of a campaign: what happens to whom, for how long, and after how much of the study.
//!
//! Next file to read: [`super::studies`].

use std::time::Duration;

use super::draw::Draw;
use super::studies::Sort;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    WorkerKilled,
    WorkerStopped,
    SolverKilled,
    SolverPaused,
    SolverStopped,
    CoordinatorKilled,
    CoordinatorStopped,
    LinkCut,
    LinkHeld,
    LinkDown,
    FrameFlipped,
    FrameShortened,
    FrameLengthened,
    FolderFull,
    ScratchFull,
}

use Kind::{
    CoordinatorKilled, CoordinatorStopped, FolderFull, FrameFlipped, FrameLengthened, FrameShortened,
    LinkCut, LinkDown, LinkHeld, ScratchFull, SolverKilled, SolverPaused, SolverStopped, WorkerKilled,
    WorkerStopped,
};

/// Of every study, on every machine.
const ANYWHERE: [Kind; 10] = [
    WorkerKilled,
    WorkerKilled,
    WorkerStopped,
    CoordinatorKilled,
    CoordinatorStopped,
    LinkCut,
    LinkHeld,
    FrameFlipped,
    FrameShortened,
    FrameLengthened,
];

/// Where network and disks may be made.
const IN_NAMESPACE: [Kind; 2] = [LinkDown, FolderFull];

/// Of studies whose model is a program.
const OF_SOLVERS: [Kind; 4] = [SolverKilled, SolverKilled, SolverPaused, SolverStopped];

/// The silence after which either side counts as lost, of a worker and of a coordinator, and a moment more.
pub(crate) const SILENCE: [Duration; 2] = [Duration::from_millis(16_500), Duration::from_secs(33)];

impl Kind {
    /// What happens, for people.
    pub(crate) fn says(self) -> &'static str {
        match self {
            WorkerKilled => "a worker is killed (`kill -9`), another one comes",
            WorkerStopped => "a worker is stopped (`kill -STOP`) and goes on",
            SolverKilled => "a solver is killed",
            SolverPaused => "a solver is stopped and goes on",
            SolverStopped => "a solver is stopped for ever",
            CoordinatorKilled => "the coordinator is killed and started with `--resume`",
            CoordinatorStopped => "the coordinator is stopped and goes on",
            LinkCut => "a connection is cut",
            LinkHeld => "a connection carries nothing, and goes on",
            LinkDown => "the link of a worker goes down, and up again (network namespace)",
            FrameFlipped => "a bit on the way is flipped",
            FrameShortened => "bytes on the way are lost",
            FrameLengthened => "bytes appear on the way",
            FolderFull => "the disk of the run folder is full (namespace), then `--resume`",
            ScratchFull => "the disk of the workers' scratch folders is full (namespace)",
        }
    }

    /// The silence that makes it a loss, where it is one that lasts.
    pub(crate) fn silence(self) -> Option<Duration> {
        match self {
            WorkerStopped | LinkHeld | LinkDown => Some(SILENCE[0]),
            CoordinatorStopped => Some(SILENCE[1]),
            _ => None,
        }
    }
}

/// A fault of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    /// Runs that are stored when it happens.
    pub(crate) at: i64,
    pub(crate) kind: Kind,
    /// The worker that it meets.
    pub(crate) worker: usize,
    /// Whether it meets all workers.
    pub(crate) all: bool,
    /// How long it lasts, where it does.
    pub(crate) lasts: Duration,
    /// For what else is to be drawn.
    pub(crate) draw: Draw,
}

/// What a campaign may do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct May {
    /// Faults that need namespaces.
    pub(crate) namespaces: bool,
    /// Faults that outlast the limits of silence.
    pub(crate) long: bool,
}

/// The faults of one campaign in a study with so many runs.
pub(crate) fn plan(seed: u64, sort: Sort, n_run: i64, may: May) -> Vec<Fault> {
    let mut draw = Draw::new(seed);
    let mut kinds = ANYWHERE.to_vec();
    if may.namespaces {
        kinds.extend(IN_NAMESPACE);
    }
    if sort.is_solver() {
        kinds.extend(OF_SOLVERS);
        kinds.extend(may.namespaces.then_some(ScratchFull));
    }
    let n = 6 + draw.below(10);
    let mut faults: Vec<Fault> = (0..n).map(|_| fault(&mut draw, &kinds, n_run, may)).collect();
    // In every third campaign some of them happen at once.
    if draw.below(3) == 0 {
        let at = faults[0].at;
        faults.iter_mut().take(4).for_each(|fault| fault.at = at);
    }
    faults.sort_by_key(|fault| fault.at);
    faults
}

fn fault(draw: &mut Draw, kinds: &[Kind], n_run: i64, may: May) -> Fault {
    let kind = draw.one_of(kinds);
    // Drawn whether it is allowed or not: the plan of a seed is the same but for the times.
    let is_long = draw.below(8) == 0 && may.long;
    let lasts = match kind.silence().filter(|_| is_long) {
        Some(silence) => silence + draw.time(500, 3000),
        None => draw.time(50, 2500),
    };
    Fault {
        at: draw.below((n_run.cast_unsigned() * 9 / 10).max(1)).cast_signed(),
        kind,
        worker: draw.below(super::workers::N as u64) as usize,
        all: draw.below(2) == 0 && is_long,
        lasts,
        draw: Draw::new(draw.next()),
    }
}
