//! The folder of an imported study: its file, the inputs, the state at the start, and predictions in the place of a recording.
//!
//! The model is run to find the state at the start and the predictions, so that a study that was written is one that runs.

use std::path::Path;

use starlings_study::field::components;
use starlings_study::twin::{Recording, Twin, beats, simulate};
use starlings_study::{SolverHost, Study};

use super::plan::{Inputs, Omission, Origin, Plan, Signal};
use super::text::{Known, text};
use crate::files::{part_of_range, write_table};
use crate::{Draft, DraftError};

/// Standard deviation of the noise as a part of a channel's range.
const NOISE: f64 = 0.02;
/// What is left out at most, as a part of what stays.
const MOST_OMITTED: f64 = 0.05;
/// Numbers of the predictions at most.
const MOST_NUMBERS: usize = 20_000_000;

/// Writes the study of a plan, read from a file, into a new folder.
pub(super) fn write(file: &Path, plan: &Plan, out: &Path, host: &SolverHost) -> Result<Draft, DraftError> {
    if out.exists() {
        return Err(DraftError::Taken(out.to_owned()));
    }
    std::fs::create_dir_all(out).map_err(|error| DraftError::Write { file: out.to_owned(), error })?;
    let written = Folder { file, plan, out, host }.fill();
    if written.is_err() {
        // What is half written would be taken for a study.
        let _ = std::fs::remove_dir_all(out);
    }
    written
}

struct Folder<'a> {
    /// Where the plan is from.
    file: &'a Path,
    plan: &'a Plan,
    out: &'a Path,
    host: &'a SolverHost,
}

impl Folder<'_> {
    fn fill(&self) -> Result<Draft, DraftError> {
        let Plan { inputs, course, .. } = self.plan;
        let (n, mut known) = (course.n_shown(), Known::default());
        self.predictions(&self.times(n)?, None)?;
        self.start(&mut known)?;
        self.inputs(inputs, n)?;
        if !course.all {
            self.last_period(&mut known)?;
        }
        let recording = simulate(&self.load(&known)?, &Twin::default())?;
        known.noise = self.noise(&recording);
        known.notes = self.omitted(&recording)?;
        self.predictions(&recording.times, Some(&recording))?;
        self.load(&known)?;
        let notes = self.plan.notes.iter().chain(&known.notes).cloned().collect();
        Ok(Draft { study: self.out.join("study.toml"), notes })
    }

    /// Writes the state in which the program starts.
    fn start(&self, known: &mut Known) -> Result<(), DraftError> {
        let Plan { inputs, course, .. } = self.plan;
        self.inputs(&inputs.steady(), course.n_shown())?;
        let study = self.load(known)?;
        if study.spec.states.is_empty() || course.from == Origin::Rest {
            return Ok(());
        }
        let found = if course.from == Origin::Zero {
            let given = |name: &String| self.plan.initial.iter().find(|(state, _)| state == name);
            let value = |name: &String| given(name).map_or(0.0, |(_, value)| *value);
            components(&study.spec.states).into_iter().map(|name| (name.clone(), value(&name))).collect()
        } else {
            let (period, times) = (Some(inputs.period), vec![0.0, inputs.period]);
            simulate(&study, &Twin { period, times, ..Twin::default() })?.start
        };
        known.initial = true;
        self.initial(&found)
    }

    /// Runs period after period as the program does, and writes the state at the start of the last.
    fn last_period(&self, known: &mut Known) -> Result<(), DraftError> {
        let Plan { inputs, course, .. } = self.plan;
        let study = self.load(known)?;
        if study.spec.states.is_empty() {
            return Ok(());
        }
        let (period, times) = (Some(inputs.period), self.times(1)?);
        let mut before: Option<Vec<f64>> = None;
        let found = beats(&study, &Twin { period, times, ..Twin::default() }, &mut |number, recording| {
            let Some((outputs, near)) = &course.settled else { return number >= course.cycles };
            let means: Vec<f64> = outputs
                .iter()
                .map(|output| {
                    column(recording, output).map_or(0.0, |v| v.iter().sum::<f64>() / v.len() as f64)
                })
                .collect();
            let settled = before
                .replace(means.clone())
                .is_some_and(|before| before.iter().zip(&means).all(|(a, b)| (a - b).abs() < *near));
            settled || number >= course.cycles
        })?;
        known.initial = true;
        self.initial(&found.start)
    }

    /// Says what was left out, and how much it is.
    fn omitted(&self, recording: &Recording) -> Result<Vec<String>, DraftError> {
        let tell = |omission: &Omission| {
            let values = column(recording, &omission.output).map_or(&[][..], Vec::as_slice);
            let part = omission.rate * values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let Omission { what, value, place, .. } = omission;
            let (percent, most) = (100.0 * part, 100.0 * MOST_OMITTED);
            if part <= MOST_OMITTED {
                return Ok(format!(
                    "{place}: {what}, {value}, which is below zero, is left out: at most {percent:.2} % of the resistance there"
                ));
            }
            let message = format!(
                "{place}: {what} is {value}, below zero, and takes up to {percent:.2} % of the resistance there: `rcr-network` has none \
                 below zero, and no more than {most} % is left out; give zero or more"
            );
            Err(DraftError::file(self.file, message))
        };
        self.plan.omissions.iter().map(tell).collect()
    }

    /// Times at which the program gives results.
    fn times(&self, periods: usize) -> Result<Vec<f64>, DraftError> {
        let Plan { points, inputs, channels, .. } = self.plan;
        let n = (points - 1).saturating_mul(periods).saturating_add(1);
        if n.saturating_mul(channels.len()) > MOST_NUMBERS {
            let message = format!("{n} times with results are more than can be written: ask for fewer");
            return Err(DraftError::file(self.out, message));
        }
        // As the inputs end, to the last bit: a record is covered by its inputs.
        let end = inputs.times[inputs.times.len() - 1] + (periods - 1) as f64 * inputs.period;
        let time = |k: usize| (inputs.period * k as f64 / (points - 1) as f64).min(end);
        Ok((0..n).map(|k| if k + 1 == n { end } else { time(k) }).collect())
    }

    /// Writes the study and reads it back.
    fn load(&self, known: &Known) -> Result<Study, DraftError> {
        let file = self.out.join("study.toml");
        std::fs::write(&file, text(self.plan, known))
            .map_err(|error| DraftError::Write { file: file.clone(), error })?;
        Ok(Study::load_with(&file, self.host)?)
    }

    fn table<R: AsRef<[String]>>(
        &self,
        name: &str,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<(), DraftError> {
        write_table(&self.out.join(name), rows)
    }

    /// The inputs over so many periods.
    fn inputs(&self, inputs: &Inputs, n: usize) -> Result<(), DraftError> {
        let heading = std::iter::once("time".to_owned()).chain(inputs.signals.iter().map(|s| s.name.clone()));
        let row = |period: usize, at: usize| {
            let time = inputs.times[at] + period as f64 * inputs.period;
            let values = inputs.signals.iter().map(|signal| signal.values[at]);
            std::iter::once(time).chain(values).map(|v| format!("{v:?}")).collect::<Vec<_>>()
        };
        // The end of a period is the start of the next.
        let rows = (0..n).flat_map(|period| {
            let first = usize::from(period > 0);
            (first..inputs.times.len()).map(move |at| (period, at))
        });
        let rows = rows.map(|(period, at)| row(period, at));
        self.table("inputs.csv", std::iter::once(heading.collect::<Vec<_>>()).chain(rows))
    }

    fn initial(&self, state: &[(String, f64)]) -> Result<(), DraftError> {
        let heading = vec!["state".to_owned(), "value".to_owned()];
        let rows = state.iter().map(|(name, value)| vec![name.clone(), format!("{value:?}")]);
        self.table("initial.csv", std::iter::once(heading).chain(rows))
    }

    /// The channels' predictions; zeros before there are any.
    fn predictions(&self, times: &[f64], recording: Option<&Recording>) -> Result<(), DraftError> {
        let names = self.plan.channels.iter().map(|(output, _)| output.clone());
        let heading: Vec<String> = std::iter::once("time".to_owned()).chain(names).collect();
        let columns: Vec<Option<&Vec<f64>>> =
            self.plan.channels.iter().map(|(output, _)| recording.and_then(|r| column(r, output))).collect();
        let rows = times.iter().enumerate().map(|(k, time)| {
            let values = columns.iter().map(|column| column.map_or(0.0, |values| values[k]));
            std::iter::once(*time).chain(values).map(|v| format!("{v:?}")).collect::<Vec<_>>()
        });
        self.table("predicted.csv", std::iter::once(heading).chain(rows))
    }

    /// A part of every channel's range; of its size where it is constant.
    fn noise(&self, recording: &Recording) -> Vec<f64> {
        let of = |(output, _): &(String, &str)| {
            part_of_range(column(recording, output).map_or(&[][..], Vec::as_slice), NOISE)
        };
        self.plan.channels.iter().map(of).collect()
    }
}

fn column<'a>(recording: &'a Recording, name: &str) -> Option<&'a Vec<f64>> {
    let at = recording.columns.iter().position(|column| column == name)?;
    recording.values.get(at)
}

impl Inputs {
    /// The same with every signal at the mean of its samples.
    fn steady(&self) -> Self {
        let signals = self.signals.iter().map(|signal| Signal {
            name: signal.name.clone(),
            values: vec![signal.mean; signal.values.len()],
            mean: signal.mean,
        });
        Self { period: self.period, times: self.times.clone(), signals: signals.collect() }
    }
}
