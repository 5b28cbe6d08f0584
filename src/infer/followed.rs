//! A recording that is still written, followed on standard output.

use std::fs::File;
use std::io::{Read, stdin};
use std::path::{Path, PathBuf};

use starlings_coordinator::infer::InferError;
use starlings_coordinator::infer::follow::line::Line;
use starlings_coordinator::infer::follow::{Source, follow};
use starlings_coordinator::study::Study;

use super::failed;
use crate::console::{line, note};
use crate::failure::Failure;

/// Follows a file, or standard input where it is `-`, to its end.
pub(super) fn run(study: &Study, source: &Path, state: Option<PathBuf>) -> Result<(), Failure> {
    if source.as_os_str() == "-" {
        return rows(study, Path::new("standard input"), stdin().lock(), state);
    }
    let text = File::open(source)
        .map_err(|error| Failure::input(format!("cannot read {}: {error}", source.display())))?;
    rows(study, source, text, state)
}

fn rows(study: &Study, name: &Path, text: impl Read, state: Option<PathBuf>) -> Result<(), Failure> {
    // A reader of standard output that leaves ends the command, with its own words.
    let mut unread = None;
    let mut failing = false;
    let mut told = |answer: &Line| {
        if let Some(error) = answer.error.as_ref().filter(|_| !failing) {
            note(format_args!("{} at time {}: {error}", name.display(), answer.time));
        }
        failing = answer.error.is_some();
        let json = serde_json::to_string(answer).map_err(|error| InferError::Setting(error.to_string()))?;
        line(json).map_err(|failure| {
            unread = Some(failure);
            InferError::Setting(String::new())
        })
    };
    let followed = follow(study, Source { name, text, state }, &mut told);
    match (followed, unread) {
        (_, Some(failure)) => Err(failure),
        (Ok(followed), None) => {
            let left_off = if followed.left_off {
                "; no line break ended its last line, which was not taken"
            } else {
                ""
            };
            let known = match followed.n_known {
                0 => String::new(),
                n => format!("; its first {n} rows were in the state already"),
            };
            note(format_args!("{} ended after {} steps{known}{left_off}", name.display(), followed.n_step));
            Ok(())
        }
        (Err(error), None) => Err(failed(&error)),
    }
}
