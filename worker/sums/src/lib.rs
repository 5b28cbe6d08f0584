//! Sums over blocks of a recording, as jobs of the fleet: what a dynamical inference sends to workers instead of runs of the model.
//!
//! [`Question`] makes of a setup the functions of its equations and where each enters; both sides make the same one. [`BlockSums`] is
//! the [`Forward`] that a worker builds of such a setup. Nothing is estimated here, and no file is read:
//! `coordinator/infer` does both. Next file to read: [`question`].

mod block_sums;
mod error;
mod expressions;
mod question;

pub use block_sums::{BlockSums, block, sums_of};
pub use error::SumsError;
pub use question::Question;

use std::sync::Arc;

use starlings_models::{Factory, Forward, Setup, SetupError};

/// What runs the jobs of a setup that asks for sums; `None` for any other setup.
pub fn build(setup: &Setup) -> Option<Result<Box<dyn Forward>, SetupError>> {
    setup.sums.as_ref()?;
    let built = BlockSums::new(setup).map_err(|error| match error {
        SumsError::Setup(error) => error,
        error => SetupError::Invalid(error.to_string()),
    });
    Some(built.map(|sums| Box::new(sums) as Box<dyn Forward>))
}

/// A factory that makes sums where a setup asks for them and leaves all others to another factory.
pub fn factory(other: Factory) -> Factory {
    Arc::new(move |setup| build(setup).unwrap_or_else(|| other(setup)))
}
