//! `starlings import`: the file of another program as a study.

use std::path::PathBuf;

use clap::Parser;
use serde_json::json;
use starlings_coordinator::draft::DraftError;
use starlings_coordinator::draft::import::import;

use crate::console::{line, note};
use crate::failure::Failure;
use crate::load;
use crate::run_folder::quoted;

/// Write a study from a file of another program: a network of svZeroDSolver (JSON) or of openBF (YAML).
///
/// The study begins with the model's own predictions in the place of a recording. What is in the file and not in the model is
/// named, and nothing is written.
#[derive(Parser)]
pub(crate) struct Args {
    /// The file.
    file: PathBuf,
    /// Folder of the study; by default named as the file, in the current folder. It must not be there yet.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print what was written as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Imports.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let out = match (&args.out, args.file.file_stem()) {
        (Some(out), _) => out.clone(),
        (None, Some(stem)) => PathBuf::from(stem),
        (None, None) => return Err(Failure::input("the file has no name: give a folder with --out")),
    };
    let draft = import(&args.file, &out, &load::host_here()).map_err(|error| match error {
        DraftError::Write { .. } => Failure::run(error),
        _ => Failure::input(error),
    })?;
    if args.json {
        return line(format_args!("{:#}", json!({ "study": draft.study, "notes": draft.notes })));
    }
    for text in &draft.notes {
        note(text);
    }
    let study = draft.study.display();
    let word = quoted(&study.to_string());
    line(format_args!("{study} was written: `starlings check {word}` says what a run would do"))
}
