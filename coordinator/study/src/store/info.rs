//! What a store keeps of its study, so that a report needs nothing else.
//!
//! Names and labels only; what decides the numbers is in [`super::meaning`]. Next file to read: [`super::folder`].

use serde::{Deserialize, Serialize};
use starlings_models::Role;

use crate::field::quantity_of;
use crate::{Study, ThetaEntry};

/// What the store keeps of the study so that a report needs nothing else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StudyInfo {
    /// Study name.
    pub name: String,
    /// The study's own description.
    pub says: Option<String>,
    /// Model kind.
    pub model: String,
    /// Estimator in one line.
    pub estimator: String,
    /// `filter` or `batch`: what the steps of the store mean.
    pub batch: bool,
    /// Seed.
    pub seed: u64,
    /// Time unit.
    pub time_unit: String,
    /// Output names and units.
    pub outputs: Vec<(String, String)>,
    /// Names of parameters that are estimated through a logarithm.
    pub logarithmic: Vec<String>,
    /// Names of parameters that are a stiffness.
    #[serde(default)]
    pub stiffness: Vec<String>,
    /// Names of the model's states.
    #[serde(default)]
    pub states: Vec<String>,
    /// Where the study file stood.
    #[serde(default)]
    pub file: String,
    /// Record names and training spans; `None` for a record that is held out as a whole.
    pub records: Vec<(String, Option<[f64; 2]>)>,
    /// The command line of the run.
    pub command: String,
    /// When the run started, as text.
    pub started: String,
    /// Version of the program.
    pub version: String,
}

/// Names in the estimated vector of parameters that the model calls a stiffness.
fn stiffness(study: &Study) -> Vec<String> {
    let is_one = |entry: &&ThetaEntry| {
        let name = &study.parameters[entry.parameter].name;
        quantity_of(&study.spec.parameters, name).is_some_and(|q| q.role == Role::Stiffness)
    };
    study.theta.iter().filter(is_one).map(|entry| entry.name.clone()).collect()
}

pub(super) fn info(study: &Study, command: &str, started: &str) -> StudyInfo {
    use starlings_estimators::Transform;
    let unit = |output: &String| {
        let mut channels = study.records.iter().flat_map(|r| &r.channels).filter(|c| &c.output == output);
        let of_model = || quantity_of(&study.spec.outputs, output).map(|q| q.unit.clone());
        channels.find_map(|c| c.unit.clone()).or_else(of_model).unwrap_or_default()
    };
    StudyInfo {
        name: study.name.clone(),
        says: Some(study.says.clone()).filter(|s| !s.is_empty()),
        model: study.setup.model.kind.clone(),
        estimator: study.describe_estimator(),
        batch: !study.estimator.kind.is_filter(),
        seed: study.seed,
        time_unit: study.time_unit.clone(),
        outputs: study.setup.outputs.iter().map(|o| (o.clone(), unit(o))).collect(),
        logarithmic: study
            .theta
            .iter()
            .filter(|t| matches!(t.transform, Transform::Log | Transform::Log2))
            .map(|t| t.name.clone())
            .collect(),
        stiffness: stiffness(study),
        states: study.spec.states.iter().map(|q| q.name.clone()).collect(),
        file: std::path::absolute(&study.file).unwrap_or_else(|_| study.file.clone()).display().to_string(),
        records: study.records.iter().map(|r| (r.name.clone(), r.train_span())).collect(),
        command: command.to_owned(),
        started: started.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}
