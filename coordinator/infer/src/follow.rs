//! A recording that is still written: the estimate after every block, and an alarm when the last blocks no longer fit those before.
//!
//! Everything is computed here, row by row, in constant memory. After an alarm the last blocks are the new reference and the new start of
//! the estimate. Next files to read: [`line`](mod@line), what is told, and `state.rs`, what a restart goes on from.

mod follower;
mod known;
pub mod line;
pub(crate) mod state;
mod whole_lines;

use std::io::Read;
use std::path::{Path, PathBuf};

use starlings_estimators::inference::InferenceError;
use starlings_study::Study;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::error::InferError;
use crate::even_step::even_step;
use crate::rows::{Row, Rows};
use crate::run::{asked, choice};
use follower::Follower;
use known::Known;
use line::Line;
use whole_lines::WholeLines;

/// Rows from which the sampling step is taken where the study does not say it.
const FIRST: usize = 100;

/// What to do where a state and a recording do not belong together.
const ANOTHER: &str = "is it another recording, or begun anew? give it a state file of its own";

/// Where rows come from, and what a restart goes on from.
pub struct Source<'a, R> {
    /// What the text is called in messages.
    pub name: &'a Path,
    /// The text: a line with the names of the columns, then rows.
    pub text: R,
    /// File of the state, read where it is there and written after every block.
    pub state: Option<PathBuf>,
}

/// How far a recording was followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Followed {
    /// Steps, with those of the state.
    pub n_step: u64,
    /// Rows that the state had taken already.
    pub n_known: u64,
    /// Whether its last line was not taken, since no line break ended it.
    pub left_off: bool,
}

/// Follows a recording to its end, with the columns of the study's first record. `told` hears a line per block.
///
/// # Errors
/// For a choice that needs the whole recording; for a row that is not what it should be, with its line; for a state of another study;
/// where the recording ends before its first block.
pub fn follow<R: Read>(
    study: &Study,
    source: Source<'_, R>,
    told: &mut dyn FnMut(&Line) -> Result<(), InferError>,
) -> Result<Followed, InferError> {
    let settings = choice(study)?;
    row_by_row(settings)?;
    let Some(record) = settings.records.first() else {
        return Err(InferError::Setting(
            "the study has no record whose columns could be followed".to_owned(),
        ));
    };
    let text = WholeLines::new(source.text);
    let mut rows = Rows::new(source.name, text, &record.time, &record.columns)?;
    let saved = source.state.as_deref().map_or(Ok(None), state::read)?;
    let mut first = First::default();
    let step = match &saved {
        Some(saved) => saved.step,
        None => first.read(&mut rows, record.columns.len(), settings.sums.step)?,
    };
    let asked = asked(study, settings, step)?;
    let mut follower = Follower::new(&asked, step)?;
    let mut known = Known::default();
    if let Some(saved) = saved {
        let file = source.state.clone().unwrap_or_default();
        let damaged = |message: String| InferError::State { file: file.clone(), message };
        known = Known::up_to(saved.stream.last.clone());
        follower.resume(saved).map_err(|error| damaged(error.to_string()))?;
    }
    let mut values = vec![0.0; record.columns.len()];
    while let Some((line, time)) = first.next(&mut rows, &mut values)? {
        if known.has(time, &values).map_err(|message| rows.fault(Some(line), message, ANOTHER))? {
            continue;
        }
        let answer = follower
            .push(time, &values)
            .map_err(|error| told_at(&rows, line.saturating_sub(follower.rows_since(&error)), &error))?;
        if let Some(answer) = answer {
            told(&answer)?;
            if let Some(file) = &source.state {
                state::write(file, &follower.saved()?)?;
            }
        }
    }
    known.ended().map_err(|message| rows.fault(None, message, ANOTHER))?;
    if follower.n_step < settings.follow.block as u64 {
        let message = format!(
            "the recording ended after {} steps, before a block of {} was full",
            follower.n_step, settings.follow.block
        );
        return Err(rows.fault(None, message, "a smaller [infer.follow] block answers sooner"));
    }
    Ok(Followed { n_step: follower.n_step, n_known: known.n_row, left_off: rows.text().left_off })
}

/// Refuses what is made of a whole recording.
fn row_by_row(choice: &InferChoice) -> Result<(), InferError> {
    let refuse = |what: &str, help: &str| {
        Err(InferError::Setting(format!("{what} is not part of --follow, which goes on row by row: {help}")))
    };
    if matches!(choice.measured, MeasuredChoice::Known(_)) {
        return refuse(
            "a given `measurement_noise`, which smooths a whole recording,",
            "use \"auto\" or \"none\"",
        );
    }
    if choice.sums.levels > 1 {
        return refuse("`richardson`", "leave it out, or infer from the recording when it has ended");
    }
    if choice.missing.is_some() {
        return refuse("[infer.candidates]", "leave it out, or infer from the recording when it has ended");
    }
    if choice.resample {
        return refuse(
            "`resample`",
            "give a stream with equal steps, or infer from the recording when it has ended",
        );
    }
    if choice.reduced.is_some() {
        return refuse("[infer.reduced]", "leave it out, or infer from the recording when it has ended");
    }
    Ok(())
}

/// An error of a row with its line.
fn told_at<R: Read>(rows: &Rows<R>, line: u64, error: &InferenceError) -> InferError {
    let help = match error {
        InferenceError::NotIncreasing { .. } => "a stream gives every row once, in the order of time",
        InferenceError::TimeJump { .. } => "rows are missing: follow the part behind it by itself",
        InferenceError::NonUniform { .. } => "a stream has equal steps",
        _ => "see [infer] of the study",
    };
    rows.fault(Some(line), error.to_string(), help)
}

/// The first rows, which say the sampling step.
#[derive(Default)]
struct First {
    /// Line, time and values, the next one last.
    rows: Vec<(u64, f64, Vec<f64>)>,
}

impl First {
    fn read<R: Read>(&mut self, rows: &mut Rows<R>, width: usize, given: f64) -> Result<f64, InferError> {
        if given > 0.0 {
            return Ok(given);
        }
        let mut values = vec![0.0; width];
        while self.rows.len() < FIRST {
            let Some(Row { line, time, .. }) = rows.next(&mut values)? else { break };
            self.rows.push((line, time, values.clone()));
        }
        let times: Vec<f64> = self.rows.iter().map(|(_, time, _)| *time).collect();
        self.rows.reverse();
        let short = || {
            rows.fault(
                None,
                format!("the recording ended after {} rows", times.len()),
                "an inference needs many rows",
            )
        };
        even_step(&times).ok_or_else(short)
    }

    fn next<R: Read>(
        &mut self,
        rows: &mut Rows<R>,
        values: &mut [f64],
    ) -> Result<Option<(u64, f64)>, InferError> {
        if let Some((line, time, held)) = self.rows.pop() {
            values.copy_from_slice(&held);
            return Ok(Some((line, time)));
        }
        Ok(rows.next(values)?.map(|row| (row.line, row.time)))
    }
}
