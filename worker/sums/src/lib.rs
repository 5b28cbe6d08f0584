//! Sums over blocks of a recording, as jobs of the fleet: what a dynamical inference sends to workers instead of runs of the model.
//!
//! [`Question`] makes of a setup the functions of its equations and where each enters; both sides make the same one. [`BlockSums`] is
//! the [`Forward`] that a worker builds of such a setup. Nothing is estimated here: `coordinator/infer` does it. A recording's file is
//! read where [`Reading`] allows it, otherwise rows come with the job. Next file to read: [`question`].

mod answer;
mod block_sums;
mod error;
mod expressions;
mod file_rows;
mod pieces;
mod question;

pub use answer::{BlockAnswer, Fault, answer_of};
pub use block_sums::{BlockSums, Reading, block, file_block, file_part};
pub use error::SumsError;
pub use file_rows::{Bytes, Part, stamp};
pub use question::Question;

use std::sync::Arc;

use starlings_models::{Factory, Forward, Setup, SetupError};

/// What runs the jobs of a setup that asks for sums; `None` for any other setup.
pub fn build(setup: &Setup, reading: Reading) -> Option<Result<Box<dyn Forward>, SetupError>> {
    setup.sums.as_ref()?;
    let built = BlockSums::new(setup, reading).map_err(|error| match error {
        SumsError::Setup(error) => error,
        error => SetupError::Invalid(error.to_string()),
    });
    Some(built.map(|sums| Box::new(sums) as Box<dyn Forward>))
}

/// A factory that makes sums where a setup asks for them and leaves all others to another factory.
pub fn factory(other: Factory, reading: Reading) -> Factory {
    Arc::new(move |setup| build(setup, reading).unwrap_or_else(|| other(setup)))
}
