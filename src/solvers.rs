//! The external solvers of this process, watched over by `starlings guard`.

use clap::builder::{PossibleValue, PossibleValuesParser};
use starlings_worker::solver::adapters;
use starlings_worker::{SiteOptions, Solvers};

use crate::failure::Failure;

/// Solvers of which none is started yet.
pub(crate) fn solvers() -> Result<Solvers, Failure> {
    let program = std::env::current_exe().map_err(Failure::run)?;
    Ok(Solvers::new(SiteOptions { guard: Some((program, vec!["guard".to_owned()])), scratch: None }))
}

/// Takes the name of a way to reach a solver, and shows them all where it is another.
pub(crate) fn adapter_names() -> PossibleValuesParser {
    adapters().map(|(name, says)| PossibleValue::new(name).help(says)).into()
}
