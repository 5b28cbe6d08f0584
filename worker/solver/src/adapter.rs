//! The ways to reach a solver, one file each; what studies may say of them stands in `proto/src/adapters.rs`.
//!
//! An adapter turns a run into whatever its solver understands and the answer back; it decides nothing about retries. Next
//! files to read: [`grpc`], then the others.

use std::sync::Arc;

use starlings_models::{Description, ParticleError, Run, Solved, SolverDef, nearest};
use starlings_proto::adapters::ADAPTERS;

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

/// What opens each of [`ADAPTERS`], in their order.
const OPEN: [(&str, Open); ADAPTERS.len()] = [
    ("grpc", grpc::open),
    ("command", command::open),
    ("fmu", fmu::open),
    ("um-bridge", um_bridge::open),
    ("mpi", mpi::open),
];

/// The adapter that a study names.
///
/// # Errors
/// When there is none of that name, or the study lacks what it needs.
pub(crate) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    let Some((_, open)) = OPEN.iter().find(|(name, _)| *name == def.adapter) else {
        let names = ADAPTERS.iter().map(|adapter| adapter.name);
        return Err(SolverError::Adapter {
            name: def.adapter.clone(),
            nearest: nearest(&def.adapter, names.clone()),
            known: names.collect::<Vec<_>>().join(", "),
        });
    };
    open(def, site)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_adapter_that_a_study_may_name_can_be_opened() {
        assert_eq!(OPEN.map(|(name, _)| name), ADAPTERS.map(|adapter| adapter.name));
    }
}
