//! A solver that serves `solver.proto`: one program per slot, started when first needed, or one that somebody else started.
//!
//! A program that dies under a run is started anew and the run is made again, since a run changes nothing outside its folder;
//! what the solver itself reports is an answer and is not asked twice. Next files to read: [`super::super::instance`] for one
//! program, [`super::super::backoff`] for how fast it may be started again.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef, Timeout};
use starlings_proto::adapters::{AdapterDef, NamedBy};

use super::Adapter;
use crate::SolverError;
use crate::backoff::Backoff;
use crate::core_slots::{CoreSlot, CoreSlots};
use crate::instance::{How, Instance};
use crate::losses::Losses;
use crate::site::Site;

/// What it says of itself.
pub(crate) const DEF: AdapterDef = AdapterDef {
    name: "grpc",
    says: "a program that serves solver.proto, or an address where one does",
    describes_itself: true,
    per_run: false,
    named_by: NamedBy::CommandOrAddress(
        "program and arguments, such as `[\"python3\", \"beam.py\"]` (or `address`)",
    ),
    keys: &["address", "described"],
};

/// Programs that the command of the definition starts, or one at its address.
///
/// # Errors
/// When the study lacks what it needs.
pub(super) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    Ok(Box::new(Grpc::new(def, site, def.command.clone())?))
}

/// Programs that serve `solver.proto`.
pub(crate) struct Grpc {
    def: SolverDef,
    command: Vec<String>,
    site: Arc<Site>,
    idle: Mutex<Vec<PinnedInstance>>,
    backoff: Mutex<Backoff>,
    core_slots: CoreSlots,
}

/// A program and the slot of cores that it is bound to, which is free again after its end.
struct PinnedInstance {
    instance: Instance,
    _core_slot: CoreSlot,
}

impl Grpc {
    /// Programs that `command` starts, or one at the address of the definition.
    ///
    /// # Errors
    /// When there is neither.
    pub(crate) fn new(def: &SolverDef, site: &Arc<Site>, command: Vec<String>) -> Result<Self, SolverError> {
        if command.is_empty() && def.address.is_none() {
            let message = "a solver needs a `command` that starts it, or an `address` where it listens";
            return Err(SolverError::Incomplete(message.to_owned()));
        }
        let (idle, backoff, core_slots) = (Mutex::default(), Mutex::default(), CoreSlots::default());
        Ok(Self { def: def.clone(), command, site: Arc::clone(site), idle, backoff, core_slots })
    }

    /// An idle program, or a new one.
    fn take(&self) -> Result<PinnedInstance, SolverError> {
        while let Some(idle) = self.idle() {
            // A program whose folder was taken away would fail: it ends here.
            if !idle.instance.is_homeless() {
                return Ok(idle);
            }
        }
        let pause = self.backoff.lock().unwrap_or_else(PoisonError::into_inner).pause();
        std::thread::sleep(pause);
        let core_slot = self.core_slots.take();
        let instance = Instance::start(&self.def, &self.command, &self.site, core_slot.number());
        let mut backoff = self.backoff.lock().unwrap_or_else(PoisonError::into_inner);
        if instance.is_ok() {
            backoff.worked();
        } else {
            backoff.failed();
        }
        Ok(PinnedInstance { instance: instance?, _core_slot: core_slot })
    }

    fn idle(&self) -> Option<PinnedInstance> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop()
    }

    fn give_back(&self, pinned: PinnedInstance) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(pinned);
    }
}

impl Adapter for Grpc {
    fn describe(&self) -> Result<Description, SolverError> {
        let mut losses = Losses::default();
        let mut pinned = loop {
            match self.take() {
                Err(SolverError::NotReady { killed: true, .. }) if losses.killed() => {}
                taken => break taken?,
            }
        };
        let description = pinned.instance.describe()?;
        self.give_back(pinned);
        Ok(description)
    }

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        let patience = Duration::try_from_secs_f64(self.def.timeout).unwrap_or(Duration::MAX);
        let mut losses = Losses::default();
        loop {
            let mut pinned = match self.take() {
                Ok(pinned) => pinned,
                Err(error) => {
                    let killed = matches!(error, SolverError::NotReady { killed: true, .. });
                    let retry = if killed { losses.killed() } else { losses.fell() };
                    // A program that is not even ready has not seen the parameters.
                    if !retry {
                        return Err(ParticleError::Infrastructure(error.to_string()));
                    }
                    continue;
                }
            };
            match pinned.instance.run(run, patience) {
                Ok(answer) => {
                    let homeless = answer.is_err() && pinned.instance.is_homeless();
                    if homeless && losses.killed() {
                        continue;
                    }
                    self.give_back(pinned);
                    return answer;
                }
                // The program is gone or of no more use: dropping it ends its whole group.
                Err(lost) => {
                    let retry = match lost.how {
                        How::Silent | How::Stopped | How::Unwanted => false,
                        How::Fell => losses.fell(),
                        How::Killed => losses.killed(),
                    };
                    let times = losses.total() + u32::from(matches!(lost.how, How::Silent | How::Stopped));
                    let text = lost.text(times);
                    drop(pinned);
                    tracing::warn!(particle = run.particle, record = run.record, times, "{text}");
                    if !retry {
                        return Err(match lost.how {
                            How::Silent => Timeout { limit: self.def.timeout, says: text }.into(),
                            How::Fell => ParticleError::Undecided(text),
                            How::Killed | How::Stopped | How::Unwanted => ParticleError::Infrastructure(text),
                        });
                    }
                }
            }
        }
    }

    fn run_and_leave(&self, run: &Run<'_>) -> bool {
        let Ok(mut pinned) = self.take() else { return false };
        pinned.instance.leave(run);
        self.give_back(pinned);
        true
    }
}
