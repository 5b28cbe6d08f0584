//! The folder of a first version: written, read back, and run once, so that a study that stands there is one that runs.
//!
//! Next file to read: [`super::parts`].

use std::path::Path;

use starlings_study::trial::{Depth, dry_run};
use starlings_study::twin::{Twin, simulate};
use starlings_study::{SolverHost, Study};

use super::parts::{NOISE, Numbers, Part, Parts};
use super::predicted::Prediction;
use super::recording::Recording;
use super::text::{Noise, text};
use crate::files::{part_of_range, write_table};
use crate::{Draft, DraftError};

/// Writes a study into a new folder; leaves none where it does not run.
pub(super) fn write(parts: Parts, out: &Path, host: &SolverHost) -> Result<Draft, DraftError> {
    std::fs::create_dir_all(out).map_err(|error| DraftError::Write { file: out.to_owned(), error })?;
    let written = Folder { parts, out, host }.fill();
    if written.is_err() {
        // What is half written would be taken for a study.
        let _ = std::fs::remove_dir_all(out);
    }
    written
}

struct Folder<'a> {
    parts: Parts,
    out: &'a Path,
    host: &'a SolverHost,
}

impl Folder<'_> {
    fn fill(mut self) -> Result<Draft, DraftError> {
        if let Some(file) = &self.parts.model.copy {
            self.copy(file, &file.file_name().unwrap_or_default().to_string_lossy())?;
        }
        for part in &self.parts.records {
            match &part.numbers {
                Numbers::Measured(recording, _) if recording.as_it_is => {
                    self.copy(&recording.file, &part.file)?;
                }
                Numbers::Measured(recording, complete) => self.rows(part, recording, complete)?,
                Numbers::Predicted(prediction) => self.predicted(part, prediction, None)?,
            }
        }
        self.predict()?;
        let mut study = match self.load(Noise::FromData) {
            Ok(study) => study,
            // Too few samples, or none that scatter.
            Err(_) => self.load(Noise::OfRange)?,
        };
        let kind = study.estimator.kind;
        dry_run(&mut study, kind, Depth::All).map_err(|error| DraftError::Trial(error.to_string()))?;
        Ok(Draft { study: self.out.join("study.toml"), notes: self.parts.notes })
    }

    fn copy(&self, file: &Path, name: &str) -> Result<(), DraftError> {
        let to = self.out.join(name);
        std::fs::copy(file, &to).map(drop).map_err(|error| DraftError::Write { file: to, error })
    }

    /// Writes the study and reads it back.
    fn load(&self, noise: Noise) -> Result<Study, DraftError> {
        let file = self.out.join("study.toml");
        std::fs::write(&file, text(&self.parts, noise))
            .map_err(|error| DraftError::Write { file: file.clone(), error })?;
        Ok(Study::load_with(&file, self.host)?)
    }

    /// A recording in the form that a study reads. Inputs that must be complete are linear across gaps, as a run takes them anyway.
    fn rows(&self, part: &Part, recording: &Recording, complete: &[String]) -> Result<(), DraftError> {
        let heading: Vec<String> = std::iter::once(&recording.time)
            .chain(recording.columns.iter().map(|c| &c.heading))
            .cloned()
            .collect();
        let columns: Vec<Vec<f64>> = recording
            .columns
            .iter()
            .map(|column| {
                if complete.contains(&column.heading) {
                    filled(&recording.times, &column.values)
                } else {
                    column.values.clone()
                }
            })
            .collect();
        let rows = recording.times.iter().enumerate().map(|(row, time)| {
            let values = columns.iter().map(|values| values[row]);
            std::iter::once(*time).chain(values).map(cell).collect::<Vec<_>>()
        });
        write_table(&self.out.join(&part.file), std::iter::once(heading).chain(rows))
    }

    /// Runs the model where its predictions stand for a recording.
    fn predict(&mut self) -> Result<(), DraftError> {
        let Some(part) = self.parts.records.first() else { return Ok(()) };
        let Numbers::Predicted(prediction) = &part.numbers else { return Ok(()) };
        let study = self.load(Noise::OfRange)?;
        let recording = simulate(&study, &Twin::default())?;
        self.predicted(part, prediction, Some((&recording.columns, &recording.values)))?;
        let of = |output: &str| {
            let belongs = |column: &String| {
                column == output || column.strip_prefix(output).is_some_and(|r| r.starts_with('['))
            };
            let columns =
                recording.columns.iter().zip(&recording.values).filter(|(column, _)| belongs(column));
            columns.flat_map(|(_, values)| values.iter().copied()).collect::<Vec<_>>()
        };
        for channel in &mut self.parts.records[0].channels {
            channel.share = part_of_range(&of(&channel.output), NOISE);
        }
        Ok(())
    }

    fn predicted(
        &self,
        part: &Part,
        prediction: &Prediction,
        found: Option<(&Vec<String>, &Vec<Vec<f64>>)>,
    ) -> Result<(), DraftError> {
        let row =
            |time: f64, values: Vec<f64>| std::iter::once(time).chain(values).map(cell).collect::<Vec<_>>();
        let heading =
            |names: Vec<String>| std::iter::once("time".to_owned()).chain(names).collect::<Vec<_>>();
        if !prediction.inputs.is_empty() {
            let names = prediction.inputs.iter().map(|(name, _)| name.clone()).collect();
            let rows = prediction.times.iter().enumerate();
            let rows = rows
                .map(|(k, time)| row(*time, prediction.inputs.iter().map(|(_, values)| values[k]).collect()));
            write_table(&self.out.join("inputs.csv"), std::iter::once(heading(names)).chain(rows))?;
        }
        // Before the model has run, zeros hold the place.
        let spec = self.parts.model.spec.as_ref();
        let outputs = spec.into_iter().flat_map(|spec| &spec.outputs);
        let outputs = outputs.filter(|q| part.channels.iter().any(|c| c.output == q.name));
        let outputs: Vec<_> = outputs.cloned().collect();
        let names = starlings_study::field::components(&outputs);
        let column = |name: &String| {
            let (columns, values) = found?;
            Some(&values[columns.iter().position(|column| column == name)?])
        };
        let columns: Vec<Option<&Vec<f64>>> = names.iter().map(column).collect();
        let rows = prediction.times.iter().enumerate();
        let rows = rows
            .map(|(k, time)| row(*time, columns.iter().map(|c| c.map_or(0.0, |values| values[k])).collect()));
        write_table(&self.out.join(&part.file), std::iter::once(heading(names)).chain(rows))
    }
}

/// A number with all its digits; a gap is empty.
fn cell(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}

/// Linear across gaps; before the first value and after the last as they are.
fn filled(times: &[f64], values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let at = |row: usize| {
        let after = known.partition_point(|known| *known < row);
        match (after.checked_sub(1).and_then(|before| known.get(before)), known.get(after)) {
            (_, Some(exact)) if *exact == row => values[row],
            (Some(a), Some(b)) => {
                let part = (times[row] - times[*a]) / (times[*b] - times[*a]);
                (1.0 - part).mul_add(values[*a], part * values[*b])
            }
            (Some(only), None) | (None, Some(only)) => values[*only],
            (None, None) => f64::NAN,
        }
    };
    (0..values.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_of_an_input_are_linear_between_the_values_around_them() {
        let nan = f64::NAN;
        let found = filled(&[0.0, 1.0, 3.0, 4.0, 5.0], &[nan, 2.0, nan, 8.0, nan]);
        assert_eq!(found, [2.0, 2.0, 6.0, 8.0, 8.0]);
    }
}
