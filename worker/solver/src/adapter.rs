//! The list of ways to reach a solver, one file each: what a study may say of it and what opens it.
//!
//! An adapter turns a run into whatever its solver understands and the answer back; it decides nothing about retries. Next
//! files to read: [`grpc`], then the others.

use std::sync::Arc;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef, nearest};
use starlings_proto::adapters::AdapterDef;

use super::SolverError;
use super::site::Site;

pub(crate) mod command;
pub(crate) mod fmu;
pub(crate) mod grpc;
pub(crate) mod mpi;
pub(crate) mod um_bridge;

/// A solver that can be reached; called from every slot at the same time.
pub(crate) trait Adapter: Send + Sync {
    /// What the solver says of itself.
    ///
    /// # Errors
    /// When it cannot be reached or makes no sense.
    fn describe(&self) -> Result<Description, SolverError>;

    /// Has one run made.
    ///
    /// # Errors
    /// When the run gives no prediction; the text ends with the tail of the solver's output.
    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError>;

    /// Asks for a run and gives it up at once; whether that is possible without ending the program.
    fn run_and_leave(&self, run: &Run<'_>) -> bool {
        let _ = run;
        false
    }
}

/// Makes the adapter of a definition; nothing is started yet.
type Open = fn(&SolverDef, &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError>;

/// A way to reach a solver, and what opens it.
struct Entry {
    def: AdapterDef,
    open: Open,
}

/// Every way.
const ADAPTERS: [Entry; 5] = [
    Entry { def: grpc::DEF, open: grpc::open },
    Entry { def: command::DEF, open: command::open },
    Entry { def: fmu::DEF, open: fmu::open },
    Entry { def: um_bridge::DEF, open: um_bridge::open },
    Entry { def: mpi::DEF, open: mpi::open },
];

/// What every way says of itself.
pub(crate) fn defs() -> [AdapterDef; ADAPTERS.len()] {
    ADAPTERS.map(|entry| entry.def)
}

/// What the way of this name says of itself.
pub(crate) fn def(name: &str) -> Option<AdapterDef> {
    defs().into_iter().find(|def| def.name == name)
}

/// The adapter that a study names.
///
/// # Errors
/// When there is none of that name, or the study lacks what it needs.
pub(crate) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    let Some(entry) = ADAPTERS.iter().find(|entry| entry.def.name == def.adapter) else {
        let names = ADAPTERS.iter().map(|entry| entry.def.name);
        return Err(SolverError::Adapter {
            name: def.adapter.clone(),
            nearest: nearest(&def.adapter, names.clone()),
            known: names.collect::<Vec<_>>().join(", "),
        });
    };
    (entry.open)(def, site)
}
