//! The ways to reach a solver, one file each.
//!
//! An adapter turns a run into whatever its solver understands and the answer back; it decides nothing about retries. Next
//! files to read: [`grpc`], then the others.

use std::sync::Arc;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef, nearest};

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
pub(crate) type Open = fn(&SolverDef, &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError>;

/// One way to reach a solver.
pub(crate) struct Kind {
    /// The name in a study.
    pub(crate) name: &'static str,
    /// One plain sentence.
    pub(crate) says: &'static str,
    /// Whether the solver itself says what it is; else the study does.
    pub(crate) asks: bool,
    /// How it is opened.
    pub(crate) open: Open,
}

/// Every way.
pub(crate) const KINDS: [Kind; 5] = [grpc::KIND, command::KIND, fmu::KIND, um_bridge::KIND, mpi::KIND];

/// Whether the solver behind an adapter of this name says itself what it is.
pub(crate) fn asks(name: &str) -> bool {
    KINDS.iter().any(|kind| kind.name == name && kind.asks)
}

/// The adapter that a study names.
///
/// # Errors
/// When there is none of that name, or the study lacks what it needs.
pub(crate) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    let Some(kind) = KINDS.iter().find(|kind| kind.name == def.adapter) else {
        let names = KINDS.iter().map(|kind| kind.name);
        return Err(SolverError::Adapter {
            name: def.adapter.clone(),
            nearest: nearest(&def.adapter, names.clone()),
            known: names.collect::<Vec<_>>().join(", "),
        });
    };
    (kind.open)(def, site)
}
