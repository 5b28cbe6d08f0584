//! What a forecast is made from: a finished run, a finished inference, or the state of one that follows a recording.
//!
//! Next file to read: [`super`].

use starlings_coordinator::fleet::Fleet;
use starlings_coordinator::infer::forecast::known::Known;
use starlings_coordinator::infer::{InferError, Inference, forecast as of_inference};
use starlings_coordinator::study::forecast::{Ask, Forecast, StudyForecastError, forecast as of_run};
use starlings_coordinator::study::{RunFolder, Stage, Study};

use super::Args;
use crate::failure::Failure;
use crate::infer::{RESULT, read_result};
use crate::interrupt;
use crate::load::{self, unknown_record};

/// A study, and what is known of it when a forecast begins.
pub(super) struct Source {
    pub(super) study: Study,
    known: Posterior,
}

/// Where the posterior is.
enum Posterior {
    Run(Box<RunFolder>),
    Inference(Box<Known>),
}

impl Source {
    /// Opens what the command line names.
    pub(super) fn open(args: &Args) -> Result<Self, Failure> {
        if args.from.is_file() {
            let Some(study) = &args.study else {
                let message = format!(
                    "{} is a file: a forecast from the state of `starlings infer --follow` needs its study, --study FILE",
                    args.from.display()
                );
                return Err(Failure::input(message));
            };
            let study = Study::load_for_inference(study)?;
            let known = Known::of_state(&study, &args.from).map_err(|error| failed(&error))?;
            return Ok(Self { study, known: Posterior::Inference(Box::new(known)) });
        }
        if args.from.join(RESULT).exists() {
            return Self::inferred(args);
        }
        let folder = RunFolder::open(&args.from).map_err(Failure::input)?;
        let study = load::of_run(&folder, args.study.as_deref(), args.fleet.is_here())?;
        Ok(Self { study, known: Posterior::Run(Box::new(folder)) })
    }

    /// A finished inference, with its study as it was.
    fn inferred(args: &Args) -> Result<Self, Failure> {
        let found: Inference = read_result(&args.from)?;
        let frozen = args.from.join("study.toml");
        let text = std::fs::read_to_string(&frozen)
            .map_err(|error| Failure::input(format!("cannot read {}: {error}", frozen.display())))?;
        let place = load::place(&args.from, args.study.as_deref(), &found.file)?;
        let study = Study::from_text_for_inference(&place, &text)?;
        let known = Known::of_result(&study, &found).map_err(|error| failed(&error))?;
        Ok(Self { study, known: Posterior::Inference(Box::new(known)) })
    }

    /// The record of this name; the first without one.
    pub(super) fn record(&self, name: Option<&str>) -> Result<usize, Failure> {
        let Posterior::Inference(_) = self.known else { return load::record(&self.study, name) };
        let records = self.study.infer.as_deref().map_or(&[][..], |choice| &choice.records);
        let Some(name) = name else { return Ok(0) };
        let names = || records.iter().map(|record| record.name.as_str());
        names().position(|known| known == name).ok_or_else(|| unknown_record(name, names()))
    }

    /// Refuses what makes no forecast, before anything is started.
    pub(super) fn check(&self, ask: &Ask) -> Result<(), Failure> {
        match &self.known {
            Posterior::Run(_) => ask.check(&self.study).map_err(Failure::input),
            Posterior::Inference(known) => {
                of_inference::check(&self.study, known, ask).map_err(|error| failed(&error))
            }
        }
    }

    pub(super) fn forecast(
        &self,
        fleet: &mut dyn Fleet,
        ask: &Ask,
        watch: &mut dyn FnMut(&Stage),
    ) -> Result<Forecast, Failure> {
        let study = &self.study;
        match &self.known {
            Posterior::Run(folder) => of_run(study, folder, fleet, ask, watch).map_err(|error| match error {
                StudyForecastError::Run(cause) if cause.is_cancelled() => cancelled(),
                error if error.is_input() => Failure::input(error),
                error => Failure::run(error),
            }),
            Posterior::Inference(known) => {
                of_inference::forecast(study, known, fleet, ask, watch).map_err(|error| failed(&error))
            }
        }
    }
}

fn cancelled() -> Failure {
    interrupt::failure("nothing is kept of it: start again")
}

fn failed(error: &InferError) -> Failure {
    if error.is_cancelled() {
        return cancelled();
    }
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}
