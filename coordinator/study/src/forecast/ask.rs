//! What is asked of a forecast, and what it makes of a study: a setup, times, the outputs that are recorded.

use starlings_estimators::forecast::Level;
use starlings_models::{BuildSetup, ObserverDef, Setup, meant, nearest};

use super::StudyForecastError;
use crate::Study;
use crate::field::components;

/// Numbers of an ensemble at most: members times outputs times rows.
const MOST_NUMBERS: f64 = 2e8;

/// A level of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Threshold {
    /// The output or scalar state.
    pub output: String,
    /// The level and its side.
    pub level: Level,
}

/// What is asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ask {
    /// The record whose start, inputs and times are used.
    pub record: usize,
    /// Values by name that all members have: parameters, constants or `initial:<state>`.
    pub values: Vec<(String, f64)>,
    /// Last time; the record's end without it.
    pub until: Option<f64>,
    /// Spacing of the times after the record's end; its mean spacing without it.
    pub step: Option<f64>,
    /// Levels whose crossing is wanted.
    pub thresholds: Vec<Threshold>,
    /// Time by which the probability of a crossing is wanted.
    pub horizon: Option<f64>,
    /// Members of the ensemble.
    pub members: usize,
    /// Seed of draws and noise.
    pub seed: u64,
}

/// What members are run with.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) record: usize,
    pub(super) setup: Setup,
    pub(super) times: Vec<f64>,
    /// Values that all members have, by their place in the setup's parameters.
    pub(super) fixed: Vec<(usize, f64)>,
    pub(super) members: usize,
    pub(super) seed: u64,
}

impl Ask {
    /// Refuses what makes no forecast of this study, before anything runs.
    ///
    /// # Errors
    /// When a name is unknown, with the nearest valid one, or a time or count makes no forecast.
    pub fn check(&self, study: &Study) -> Result<(), StudyForecastError> {
        self.plan(study).map(|_| ())
    }

    /// Makes of it what members are run with.
    ///
    /// # Errors
    /// When a name is unknown, with the nearest valid one, or a time or count makes no forecast.
    pub(super) fn plan(&self, study: &Study) -> Result<Plan, StudyForecastError> {
        let mut setup = study.setup.clone();
        setup.observer = ObserverDef::default();
        setup.noise = study.setup.is_noisy().then_some(self.seed);
        let record = &study.records[self.record];
        let measured = record.channels.iter().filter(|c| c.node.is_none()).map(|c| &c.output);
        let measured = measured.chain(&study.predict.outputs);
        setup.outputs = self.outputs(study, measured)?;
        let fixed = self.set(study, &mut setup)?;
        let recorded = &record.times;
        let span = recorded.last().zip(recorded.first()).map_or(0.0, |(end, start)| end - start);
        let times = self.times(recorded, span / (recorded.len().max(2) - 1) as f64)?;
        self.room(setup.outputs.len(), times.len())?;
        Ok(Plan { record: self.record, setup, times, fixed, members: self.members, seed: self.seed })
    }

    /// Sets the values that all members have: constants in the setup, and of its parameters places with values.
    ///
    /// # Errors
    /// For a name that the model does not have, with the nearest valid one.
    pub fn set(&self, study: &Study, setup: &mut Setup) -> Result<Vec<(usize, f64)>, StudyForecastError> {
        let mut fixed = Vec::new();
        for (name, value) in &self.values {
            if let Some(place) = setup.parameters.iter().position(|p| p == name) {
                fixed.push((place, *value));
            } else {
                known(study, name)?;
                setup.model.constants.insert(name.clone(), *value);
            }
        }
        Ok(fixed)
    }

    /// Refuses an ensemble without members, or of more numbers than there is room for.
    ///
    /// # Errors
    /// When it is either.
    pub fn room(&self, n_output: usize, n_time: usize) -> Result<(), StudyForecastError> {
        if self.members > 0 && self.members as f64 * n_output as f64 * n_time as f64 <= MOST_NUMBERS {
            return Ok(());
        }
        Err(StudyForecastError::Request(format!(
            "{} members of {n_output} outputs at {n_time} times: give at least one member, and no more than {MOST_NUMBERS:e} numbers in all",
            self.members
        )))
    }

    /// What is measured, component by component, and what has a level.
    ///
    /// # Errors
    /// When a name is unknown, with the nearest valid one, or there is none.
    pub fn outputs<'a>(
        &self,
        study: &Study,
        measured: impl Iterator<Item = &'a String>,
    ) -> Result<Vec<String>, StudyForecastError> {
        let all = components(&study.spec.outputs);
        let states = study.spec.states.iter().filter(|q| q.size == 1).map(|q| q.name.clone());
        let possible: Vec<String> = all.iter().cloned().chain(states).collect();
        let mut outputs: Vec<String> = Vec::new();
        let asked = self.thresholds.iter().map(|t| t.output.clone());
        for name in measured.cloned().chain(asked) {
            if !possible.contains(&name) {
                let hint = meant(nearest(&name, &possible));
                let message = format!("no output or scalar state named `{name}`{hint}");
                return Err(StudyForecastError::Request(message));
            }
            if !outputs.contains(&name) {
                outputs.push(name);
            }
        }
        if outputs.is_empty() {
            let message =
                "the record measures no output: name one with --level, as in --level \"pressure>5\"";
            return Err(StudyForecastError::Request(message.to_owned()));
        }
        Ok(outputs)
    }

    /// Times of the record, regular ones after its end, the end that was asked for and the horizon. `usual` is the spacing where none
    /// is asked for.
    ///
    /// # Errors
    /// When the end, the horizon or the spacing make no forecast.
    pub fn times(&self, recorded: &[f64], usual: f64) -> Result<Vec<f64>, StudyForecastError> {
        let request = |message: String| Err(StudyForecastError::Request(message));
        let (start, end) = match (recorded.first(), recorded.last()) {
            (Some(start), Some(end)) => (*start, *end),
            _ => return request("the record has no times".to_owned()),
        };
        let until = self.until.unwrap_or(end);
        if !(until > start && until.is_finite()) {
            return request(format!("--until {until}: give a time after the start at {start}"));
        }
        if let Some(horizon) = self.horizon.filter(|horizon| !(*horizon > start && *horizon <= until)) {
            return request(format!(
                "--horizon {horizon}: give a time after the start at {start} and up to the end at {until}"
            ));
        }
        let step = self.step.unwrap_or(usual);
        if !(step > 0.0 && step.is_finite()) {
            return request(format!("--step {step}: give a number above zero"));
        }
        let mut times: Vec<f64> = recorded.iter().copied().filter(|t| *t <= until).collect();
        let n = ((until - end) / step + 1e-9).floor().max(0.0);
        if n > MOST_NUMBERS {
            return request(format!(
                "--until {until} with steps of {step} makes {n:.1e} rows: give a larger --step"
            ));
        }
        times.extend((1..=n as usize).map(|k| step.mul_add(k as f64, end)));
        // Nothing may be told of a time that no member reaches.
        for asked in [Some(until), self.horizon].into_iter().flatten() {
            let place = times.partition_point(|t| *t < asked - 1e-9 * step);
            if times.get(place).is_none_or(|t| *t > asked + 1e-9 * step) {
                times.insert(place, asked);
            }
        }
        Ok(times)
    }
}

/// Refuses a value for a name that the model does not have.
fn known(study: &Study, name: &str) -> Result<(), StudyForecastError> {
    let mut names: Vec<String> = study.setup.parameters.clone();
    names.extend(study.spec.parameters.iter().map(|q| q.name.clone()));
    names.extend(study.setup.model.constants.keys().cloned());
    names.extend(components(&study.spec.states).iter().map(|state| format!("initial:{state}")));
    if names.iter().any(|known| known == name) {
        return Ok(());
    }
    let hint = meant(nearest(name, &names));
    Err(StudyForecastError::Request(format!(
        "--set {name}: the study has no parameter, constant or initial value of that name{hint}"
    )))
}
