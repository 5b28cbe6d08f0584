//! The external solvers of this process, watched over by `starlings guard`.

use starlings_worker::{SiteOptions, Solvers};

use crate::failure::Failure;

/// Solvers of which none is started yet.
pub(crate) fn solvers() -> Result<Solvers, Failure> {
    let program = std::env::current_exe().map_err(Failure::run)?;
    Ok(Solvers::new(SiteOptions { guard: Some((program, vec!["guard".to_owned()])), scratch: None }))
}
