//! What the posterior says of quantities that nobody measured: an ensemble of free runs with parameters drawn from it.
//!
//! Every record is run from its start with the same draws, without an observer, and with the noise of the states where the model has it.
//! Bands are central, of 95 %, at each time by itself; errors of a measurement are not in them. Bands of measured outputs are in
//! [`crate::predictive`], and what comes after a record in [`crate::forecast`]. Next files to read: [`members`], then [`result`].

pub(crate) mod members;
pub mod result;
mod table;
pub(crate) mod times;

use starlings_estimators::Gaussian;

use crate::fit::runner::EnsembleRunner;
use crate::store::{Store, StoreError};
use crate::{RunError, Study};

pub use result::{Figure, PredictedCourse, PredictedOutput};
pub use table::to_csv;

/// Name under which the store keeps the courses, as JSON.
const PREDICTED: &str = "predicted";

/// What was predicted, with what is doubtful of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Predictions {
    /// By record and output.
    pub(crate) courses: Vec<PredictedCourse>,
    /// The same in numbers.
    pub(crate) outputs: Vec<PredictedOutput>,
    /// What is doubtful.
    pub(crate) warnings: Vec<String>,
}

/// Runs the draws and gathers what they predict; nothing where the study asks for nothing.
///
/// # Errors
/// When the fleet fails as a whole, or refuses the outputs.
pub(crate) fn predict(
    runner: &mut EnsembleRunner<'_>,
    posterior: &Gaussian,
) -> Result<Predictions, RunError> {
    let study = runner.study();
    if study.predict.outputs.is_empty() {
        return Ok(Predictions::default());
    }
    let mut found = Predictions { warnings: doubtful(study), ..Predictions::default() };
    for members in members::run(runner, posterior)? {
        members.tell(study, &mut found);
    }
    Ok(found)
}

/// What of the study makes its predictions doubtful.
fn doubtful(study: &Study) -> Vec<String> {
    let mut warnings = Vec::new();
    if study.drifts() {
        warnings.push(
            "a parameter drifts: `[predict]` takes its value at the end for the whole of every record"
                .to_owned(),
        );
    }
    if study.whole_answers && study.predict.step.is_some() {
        warnings.push(
            "the solver answers at the times of the records only: `step` of `[predict]` is left out"
                .to_owned(),
        );
    }
    warnings
}

/// What the bands are conditional on, in a sentence that follows those of the intervals.
pub(crate) fn conditional_on(study: &Study, given_residuals: bool) -> String {
    let spread = if given_residuals { "given the residuals" } else { "at the stated noise" };
    let observer = if study.observer_is_off() { "" } else { " and without the observer" };
    format!(
        " Bands of `[predict]` are of {} runs with draws of the posterior {spread}, free{observer}: they hold what is not known of the \
         parameters, and neither what the model lacks nor errors of a measurement.",
        study.predict.members
    )
}

/// Keeps the courses.
pub(crate) fn keep(store: &Store, courses: &[PredictedCourse]) -> Result<(), StoreError> {
    if courses.is_empty() {
        return Ok(());
    }
    store.set_meta(PREDICTED, &crate::store::json::json(&courses))
}

/// The courses that a run keeps; empty where it predicted nothing.
///
/// # Errors
/// When the store fails or its content is damaged.
pub fn read(store: &Store) -> Result<Vec<PredictedCourse>, StoreError> {
    let Some(text) = store.meta(PREDICTED)? else { return Ok(Vec::new()) };
    serde_json::from_str(&text).map_err(|error| store.damaged("predictions", error))
}
