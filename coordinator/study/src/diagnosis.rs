//! What `diagnose` compares: the study as it is, which is the model without a fault, and a study for every scenario.
//!
//! All of them have the records and outputs of the file; a scenario has inputs, values and unknown parameters of its own beside those of
//! the study. Next file to read: `check/diagnose.rs`, which makes them of a study file.

use crate::checked::Study;

/// The studies of a diagnosis.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The model without a fault.
    pub healthy: Study,
    /// The library, in the order of the file; none of them is of the same name as another.
    pub scenarios: Vec<Scenario>,
    /// Probability of an alarm where there is no fault.
    pub false_alarm: f64,
}

/// A fault as it may have happened.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    /// What it is, in the author's words.
    pub says: String,
    /// How likely it is beforehand, up to a factor.
    pub weight: f64,
    /// The model with the fault: parameters of the study first, then those of the scenario, the severity foremost among them.
    pub study: Study,
    /// Values of its parameters from which a search starts: index in the study's estimated vector, values in the parameter's unit.
    pub grid: Vec<(usize, Vec<f64>)>,
}

impl Diagnosis {
    /// Index of a scenario's severity in its study's estimated vector: behind everything that the healthy model has.
    pub fn severity(&self) -> usize {
        self.healthy.theta.len()
    }
}

impl Scenario {
    /// Points from which its fit starts: every combination of its grid.
    pub fn n_start(&self) -> usize {
        self.grid.iter().map(|(_, values)| values.len()).product()
    }
}
