//! Which programs a worker may start and which files it may read for a coordinator: those that its own command line names.
//!
//! Next file to read: `worker/solver/src/permit.rs`, which compares a setup with them.

use std::path::{Path, PathBuf};

use clap::Args;
use starlings_coordinator::study::{SolverHost, Study};
use starlings_models::SolverDef;
use starlings_solver::{Permit, adapters};
use starlings_worker::Reading;

use crate::console::note;
use crate::failure::Failure;

/// What a coordinator may have started here.
#[derive(Args)]
pub(crate) struct PermitArgs {
    /// The command that starts the solver on this machine, as a shell would take it apart; the only one that this worker runs.
    #[arg(long, value_name = "CMD")]
    solver: Option<String>,
    /// Run the solver of this study file of this machine, with its command, environment and files, and no other.
    #[arg(long, value_name = "STUDY", conflicts_with_all = ["solver", "describe"])]
    solver_from: Option<PathBuf>,
    /// Run whatever command a study names, and read the recordings of an inference: the coordinator can then do all that this user can.
    #[arg(long, conflicts_with_all = ["solver", "solver_from", "describe"])]
    allow_commands_from_study: bool,
}

impl PermitArgs {
    /// The program of `--solver`, in parts.
    pub(crate) fn command(&self) -> Result<Option<Vec<String>>, Failure> {
        self.solver.as_deref().map(solver_command).transpose()
    }

    /// What this worker permits.
    pub(crate) fn permit(&self) -> Result<Permit, Failure> {
        if let Some(command) = self.command()? {
            let own = SolverDef { command, folder: here()?, ..SolverDef::default() };
            return Ok(Permit::Pinned(Box::new(own)));
        }
        if let Some(study) = &self.solver_from {
            return Ok(Permit::Pinned(Box::new(solver_of(study)?)));
        }
        Ok(if self.allow_commands_from_study { Permit::Study } else { Permit::Nothing })
    }

    /// Whether recordings that an inference names are read: whoever may run any command may have any file read too.
    pub(crate) fn reading(&self) -> Reading {
        if self.allow_commands_from_study { Reading::Allowed } else { Reading::Refused }
    }

    /// Says what `--allow-commands-from-study` gives up, where somebody reads it.
    pub(crate) fn warn(&self) {
        if self.allow_commands_from_study {
            note(
                "warning: --allow-commands-from-study: whoever runs the coordinator can run any command on this machine as this user",
            );
        }
    }
}

/// A command line in parts; there must be a program.
fn solver_command(text: &str) -> Result<Vec<String>, Failure> {
    let parts =
        shell_words::split(text).map_err(|error| Failure::input(format!("--solver {text}: {error}")))?;
    if parts.first().is_none_or(String::is_empty) {
        return Err(Failure::input("--solver names no program: such as --solver \"python3 beam.py\""));
    }
    Ok(parts)
}

/// The solver that a study file of this machine names.
fn solver_of(study: &Path) -> Result<SolverDef, Failure> {
    Ok(Study::solver_of(study, &SolverHost::default().by(adapters()))?)
}

/// Where names of files in a command line lead.
pub(crate) fn here() -> Result<String, Failure> {
    Ok(std::env::current_dir().map_err(Failure::run)?.display().to_string())
}
