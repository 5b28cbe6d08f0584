//! A solver that serves `solver.proto`: one program per slot, started when first needed, or one that somebody else started.
//!
//! A program that dies under a run is started anew and the run is made again, since a run changes nothing outside its folder;
//! what the solver itself reports is an answer and is not asked twice. Next files to read: [`super::super::instance`] for one
//! program, [`super::super::backoff`] for how fast it may be started again.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef};

use super::{Adapter, Kind};
use crate::solver::SolverError;
use crate::solver::backoff::Backoff;
use crate::solver::instance::{How, Instance};
use crate::solver::site::Site;

pub(crate) const KIND: Kind = Kind {
    name: "grpc",
    says: "a program that serves solver.proto, or an address where one does",
    asks: true,
    open: |def, site| Ok(Box::new(Grpc::new(def, site, def.command.clone())?)),
};

/// Times that a run is made when its program dies: more often when it was killed from outside than when it fell by itself,
/// which is likely to happen again.
const KILLED: u32 = 12;
const FELL: u32 = 2;

/// Programs that serve `solver.proto`.
pub(crate) struct Grpc {
    def: SolverDef,
    command: Vec<String>,
    site: Arc<Site>,
    idle: Mutex<Vec<Instance>>,
    backoff: Mutex<Backoff>,
    /// Programs started so far, by which each finds its cores.
    started: Mutex<usize>,
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
        let (idle, backoff, started) = (Mutex::default(), Mutex::default(), Mutex::default());
        Ok(Self { def: def.clone(), command, site: Arc::clone(site), idle, backoff, started })
    }

    /// An idle program, or a new one.
    fn take(&self) -> Result<Instance, SolverError> {
        if let Some(instance) = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop() {
            return Ok(instance);
        }
        let pause = self.backoff.lock().unwrap_or_else(PoisonError::into_inner).pause();
        std::thread::sleep(pause);
        let number = {
            let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
            *started += 1;
            *started - 1
        };
        let instance = Instance::start(&self.def, &self.command, &self.site, number);
        let mut backoff = self.backoff.lock().unwrap_or_else(PoisonError::into_inner);
        if instance.is_ok() {
            backoff.worked();
        } else {
            backoff.failed();
        }
        instance
    }

    fn give_back(&self, instance: Instance) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(instance);
    }
}

impl Adapter for Grpc {
    fn describe(&self) -> Result<Description, SolverError> {
        let mut kills = 0;
        let mut instance = loop {
            match self.take() {
                Err(SolverError::NotReady { killed: true, .. }) if kills < KILLED => kills += 1,
                taken => break taken?,
            }
        };
        let description = instance.describe()?;
        self.give_back(instance);
        Ok(description)
    }

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        let patience = Duration::try_from_secs_f64(self.def.timeout).unwrap_or(Duration::MAX);
        let mut losses = 0;
        loop {
            let mut instance = match self.take() {
                Ok(instance) => instance,
                Err(error) => {
                    losses += 1;
                    let killed = matches!(error, SolverError::NotReady { killed: true, .. });
                    if losses >= if killed { KILLED } else { FELL } {
                        return Err(ParticleError::Solver(error.to_string()));
                    }
                    continue;
                }
            };
            match instance.run(run, patience) {
                Ok(answer) => {
                    self.give_back(instance);
                    return answer;
                }
                // The program is gone or of no more use: dropping it ends its whole group.
                Err(lost) => {
                    losses += 1;
                    let most = match lost.how {
                        How::Silent => 1,
                        How::Fell => FELL,
                        How::Killed => KILLED,
                    };
                    let text = lost.text(losses);
                    drop(instance);
                    tracing::warn!(particle = run.particle, record = run.record, losses, "{text}");
                    if losses >= most {
                        return Err(ParticleError::Solver(text));
                    }
                }
            }
        }
    }

    fn run_and_leave(&self, run: &Run<'_>) -> bool {
        let Ok(mut instance) = self.take() else { return false };
        instance.leave(run);
        self.give_back(instance);
        true
    }
}
