//! The external solvers of this process, watched over by `starlings guard`.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser};
use starlings_solver::adapters;
use starlings_solver::{SiteOptions, Solvers};

use crate::failure::Failure;

/// Solvers of which none is started yet.
pub(crate) fn solvers() -> Result<Solvers, Failure> {
    let program = own_program().map_err(Failure::run)?;
    Ok(Solvers::new(SiteOptions { guard: Some((program, vec!["guard".to_owned()])), scratch: None }))
}

/// This program; where another was put in its place, the one that runs.
pub(crate) fn own_program() -> std::io::Result<PathBuf> {
    let program = std::env::current_exe()?;
    Ok(if program.exists() { program } else { PathBuf::from("/proc/self/exe") })
}

/// Takes the name of a way to reach a solver, and shows them all where it is another.
pub(crate) fn adapter_names() -> PossibleValuesParser {
    adapters().into_iter().map(|a| PossibleValue::new(a.name).help(a.says)).into()
}
