//! The answer of a diagnosis: what `diagnose.json` holds, and all that its page is made of.
//!
//! Next file to read: [`super::words`].

use serde::{Deserialize, Serialize};

/// Level of the intervals.
pub const LEVEL: f64 = 0.9;
/// Probability above which one scenario is named alone.
pub const NAMED: f64 = 0.9;
/// Probability from which a scenario is listed where none is named alone.
pub const LISTED: f64 = 0.05;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No alarm.
    NoFault,
    /// One scenario has nearly all of the probability and leaves nothing.
    Named,
    /// Several scenarios are left.
    Undecided,
    /// There is a fault, and the likeliest scenario leaves more than noise.
    Unexplained,
}

/// A diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosed {
    /// Name of the study.
    pub study: String,
    /// Kind of the model.
    pub model: String,
    /// Unit label of every time.
    pub time_unit: String,
    /// The verdict as a word.
    pub verdict: Verdict,
    /// The verdict as a sentence.
    pub says: String,
    /// Names of the scenarios that are left, the likeliest first; empty without a fault.
    pub named: Vec<String>,
    /// Whether and since when the recording departs from the model without a fault.
    pub alarm: AlarmFound,
    /// The model without a fault.
    pub healthy: HealthyFound,
    /// The library, in the order of the study.
    pub scenarios: Vec<ScenarioFound>,
    /// Courses of what was measured, thinned, as many as a page shows.
    pub courses: Vec<CourseFound>,
    /// Measured values that were compared.
    pub n_value: usize,
    /// Runs of the model, one per point and record.
    pub runs: u64,
    /// What all of it is conditional on.
    pub conditional_on: String,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// Tests of the model without a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmFound {
    /// Probability of an alarm where there is no fault, at most: a half for each of the two kinds of test.
    pub rate: f64,
    /// The first stretch of values that noise does not explain; `None` where there is none.
    pub seen: Option<Departure>,
    /// The stretch that noise explains least.
    pub strongest: Option<Departure>,
    /// The scenario whose fit improves most on the model without a fault, by its χ².
    pub matched: Option<Matched>,
}

impl AlarmFound {
    /// Whether there is a fault.
    pub fn is_raised(&self) -> bool {
        self.seen.is_some()
            || self.matched.as_ref().is_some_and(|matched| matched.by_chance < 0.5 * self.rate)
    }
}

/// A stretch of measured values that departs from a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Departure {
    /// Record.
    pub record: String,
    /// Output.
    pub output: String,
    /// Time of its first value.
    pub since: f64,
    /// Time of its last value, at which it is seen.
    pub until: f64,
    /// χ² of the test.
    pub chi_squared: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Probability that any stretch of the whole recording is as improbable without a fault, at most.
    pub by_chance: f64,
}

/// A scenario against the model without a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matched {
    /// The scenario.
    pub scenario: String,
    /// Fall of χ² and prior from the model without a fault.
    pub chi_squared: f64,
    /// Unknowns of the scenario.
    pub degrees: usize,
    /// Probability that any scenario, from any start of its grid, falls as far without a fault, at most.
    pub by_chance: f64,
}

/// The model without a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HealthyFound {
    /// Mean square of what is left, in units of the noise variance.
    pub misfit: f64,
    /// Its parameters.
    pub parameters: Vec<ParameterFound>,
}

/// A scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenarioFound {
    /// Its name.
    pub name: String,
    /// What it is.
    pub says: String,
    /// Probability among the library.
    pub probability: f64,
    /// Log of the evidence over that of the model without a fault; `None` where it cannot be run.
    pub log_bayes_factor: Option<f64>,
    /// Mean square of what is left, in units of the noise variance.
    pub misfit: Option<f64>,
    /// Whether noise explains what is left, at the stated rate.
    pub explains: bool,
    /// Its parameters and those of the study, with 90 % intervals at the stated noise.
    pub parameters: Vec<ParameterFound>,
    /// Why it cannot be run.
    pub failure: Option<String>,
}

impl ScenarioFound {
    /// Its severity.
    pub fn severity(&self) -> Option<&ParameterFound> {
        self.parameters.iter().find(|parameter| parameter.is_severity)
    }
}

/// A parameter of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterFound {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Whether it is the scenario's severity.
    pub is_severity: bool,
    /// Likeliest value.
    pub estimate: f64,
    /// Half of the 90 % interval in standard deviations of a Gaussian.
    pub sd: f64,
    /// The 90 % interval.
    pub interval90: [f64; 2],
    /// Prior median.
    pub prior_median: f64,
}

/// What was measured of an output in a record, and what the models say of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CourseFound {
    /// Record.
    pub record: String,
    /// Output.
    pub output: String,
    /// Its unit.
    pub unit: String,
    /// Times.
    pub times: Vec<f64>,
    /// Measured values.
    pub observed: Vec<f64>,
    /// Noise sd.
    pub noise: f64,
    /// The model without a fault.
    pub healthy: Vec<f64>,
    /// The likeliest scenario.
    pub likeliest: Vec<f64>,
}
