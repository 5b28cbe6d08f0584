//! Whose server runs what: one per slot where each can have a port of its own, or one for all at a fixed address.
//!
//! Next file to read: [`super::server`].

use std::sync::{Arc, Mutex, PoisonError};

use starlings_models::SolverDef;

use super::server::Server;
use crate::SolverError;
use crate::backoff::Backoff;
use crate::core_slots::{CoreSlot, CoreSlots};
use crate::losses::Losses;
use crate::site::Site;

/// Servers of one definition.
pub(super) struct Pool {
    def: SolverDef,
    site: Arc<Site>,
    /// Servers that nobody uses; at a fixed address the one that everybody uses.
    kept: Mutex<Vec<Taken>>,
    backoff: Mutex<Backoff>,
    core_slots: CoreSlots,
}

/// A server in use, and the slot of cores that its program is bound to.
#[derive(Clone)]
pub(super) struct Taken {
    pub(super) server: Arc<Server>,
    _core_slot: Arc<CoreSlot>,
}

impl Pool {
    /// Nothing is started yet.
    pub(super) fn new(def: &SolverDef, site: &Arc<Site>) -> Self {
        let (kept, backoff, core_slots) = (Mutex::default(), Mutex::default(), CoreSlots::default());
        Self { def: def.clone(), site: Arc::clone(site), kept, backoff, core_slots }
    }

    /// Whether all slots share one server.
    fn is_shared(&self) -> bool {
        self.def.address.as_deref().is_some_and(|address| !address.contains("{port}"))
    }

    /// A server to ask, started anew where there is none or its program has ended.
    ///
    /// # Errors
    /// When it cannot be started.
    pub(super) fn take(&self) -> Result<Taken, SolverError> {
        if !self.is_shared() {
            while let Some(taken) = self.idle() {
                if !taken.server.has_ended() {
                    return Ok(taken);
                }
            }
            return self.started();
        }
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(taken) = kept.first().filter(|taken| !taken.server.has_ended()) {
            return Ok(taken.clone());
        }
        // The other slots wait here for the new one.
        kept.clear();
        let taken = self.started()?;
        kept.push(taken.clone());
        Ok(taken)
    }

    fn idle(&self) -> Option<Taken> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).pop()
    }

    fn started(&self) -> Result<Taken, SolverError> {
        let core_slot = self.core_slots.take();
        // A server for all slots may use all cores.
        let is_bound = self.def.pin && !self.is_shared();
        let cores = is_bound.then(|| self.site.cores(core_slot.number(), self.def.threads));
        let mut losses = Losses::default();
        loop {
            let pause = self.backoff.lock().unwrap_or_else(PoisonError::into_inner).pause();
            std::thread::sleep(pause);
            let started = Server::start(&self.def, &self.site, cores.clone());
            let mut backoff = self.backoff.lock().unwrap_or_else(PoisonError::into_inner);
            match started {
                Ok(server) => {
                    backoff.worked();
                    return Ok(Taken { server: Arc::new(server), _core_slot: Arc::new(core_slot) });
                }
                Err(error) => {
                    backoff.failed();
                    let killed = matches!(error, SolverError::NotReady { killed: true, .. });
                    if !(killed && losses.killed()) {
                        return Err(error);
                    }
                }
            }
        }
    }

    /// Takes a server back that is of further use.
    pub(super) fn give_back(&self, taken: Taken) {
        if !self.is_shared() {
            self.kept.lock().unwrap_or_else(PoisonError::into_inner).push(taken);
        }
    }
}
