//! Setups built so far: only a cache, filled again by the coordinator on every connection.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use starlings_models::{Forward, Setup};
use starlings_proto::words::panic_text;
use starlings_proto::{SetupId, WireError};

use crate::config::Factory;

/// Shared between the network and the thread that builds.
#[derive(Clone)]
pub(crate) struct Setups {
    factory: Factory,
    built: Arc<Mutex<BTreeMap<SetupId, Arc<dyn Forward>>>>,
}

impl Setups {
    pub(crate) fn new(factory: Factory) -> Self {
        Self { factory, built: Arc::default() }
    }

    pub(crate) fn get(&self, id: &SetupId) -> Option<Arc<dyn Forward>> {
        self.built.lock().unwrap_or_else(PoisonError::into_inner).get(id).cloned()
    }

    /// Builds a setup, or says why not. May take long: not for the network's thread.
    pub(crate) fn build(&self, id: SetupId, setup: Result<Box<Setup>, WireError>) -> Result<(), String> {
        let setup = setup.map_err(|error| error.to_string())?;
        let forward = catch_unwind(AssertUnwindSafe(|| (self.factory)(&setup)))
            .map_err(|panic| panic_text(panic.as_ref()))?
            .map_err(|error| error.to_string())?;
        self.built.lock().unwrap_or_else(PoisonError::into_inner).insert(id, Arc::from(forward));
        Ok(())
    }
}
