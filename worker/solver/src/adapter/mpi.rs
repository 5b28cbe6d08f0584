//! A solver that is itself an MPI program: launched as one solver with a number of ranks; rank 0 serves `solver.proto`.
//!
//! Idle ranks of most MPI libraries spin: a worker should have no more ranks in all its slots than cores. Next file to read:
//! [`super::grpc`].

use std::sync::Arc;

use starlings_models::SolverDef;
use starlings_proto::adapters::{AdapterDef, NamedBy};

use super::Adapter;
use super::grpc::Grpc;
use crate::SolverError;
use crate::site::Site;

/// What it says of itself.
pub(crate) const DEF: AdapterDef = AdapterDef {
    name: "mpi",
    says: "an MPI program whose rank 0 serves solver.proto",
    describes_itself: true,
    per_run: false,
    named_by: NamedBy::Command("program and arguments, such as `[\"./beam\", \"input.txt\"]`"),
    keys: &["ranks", "described"],
};

/// The launcher with the command of the definition on every rank.
///
/// # Errors
/// When the study gives no command.
pub(super) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    if def.command.is_empty() {
        let message = "an MPI solver needs a `command`, which the launcher starts on every rank";
        return Err(SolverError::Incomplete(message.to_owned()));
    }
    let mut def = def.clone();
    // Open MPI refuses to run as root, as in containers, and to share cores, unless it is told that this is meant.
    for name in [
        "OMPI_ALLOW_RUN_AS_ROOT",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
        "PRTE_ALLOW_RUN_AS_ROOT",
        "PRTE_ALLOW_RUN_AS_ROOT_CONFIRM",
        "OMPI_MCA_rmaps_base_oversubscribe",
    ] {
        def.environment.entry(name.to_owned()).or_insert_with(|| "1".to_owned());
    }
    let launcher = def.environment.get(LAUNCHER).cloned().unwrap_or_else(|| "mpiexec".to_owned());
    let ranks = ["-n".to_owned(), def.ranks.max(1).to_string()];
    let command = std::iter::once(launcher).chain(ranks).chain(def.command.clone()).collect();
    Ok(Box::new(Grpc::new(&def, site, command)?))
}

/// Variable in the solver's environment that names another launcher, such as `srun`.
const LAUNCHER: &str = "STARLINGS_MPI_LAUNCHER";
