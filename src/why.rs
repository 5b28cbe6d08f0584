//! `starlings why`: why a run stands where it does, from its folder alone.
//!
//! Next file to read: [`page::why`].

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::report as page;
use starlings_coordinator::report::WhyError;
use starlings_coordinator::study::RunFolder;

use crate::console::{line, text};
use crate::failure::Failure;

/// Say in a sentence or three why a run, a parameter, a worker, a particle or an observation of it is as it is.
///
/// Only the folder is read; a run that is running, was killed or is finished all answer as far as they got.
#[derive(Parser)]
pub(crate) struct Args {
    /// The run folder.
    dir: PathBuf,
    /// A parameter, a worker, the number of a particle, an output (its most surprising observation) or OUTPUT@TIME; without one the
    /// question is about the run: why is nothing running?
    #[arg(value_name = "OF")]
    subject: Option<String>,
    /// Print the answer as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Answers.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let folder = RunFolder::open(&args.dir).map_err(Failure::input)?;
    let answer = page::why(&folder, args.subject.as_deref()).map_err(|error| match error {
        WhyError::Store(_) => Failure::run(error),
        _ => Failure::input(error),
    })?;
    if args.json {
        return line(serde_json::to_string_pretty(&answer).map_err(Failure::run)?);
    }
    text(format_args!("{}\n{}\n", answer.about, answer.says.join("\n")))
}
