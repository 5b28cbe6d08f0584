//! What the data of a study could determine, from one ensemble around a point before the estimation is made.
//!
//! Every record runs freely from its start with sigma points close to the prior median (or to the estimate of a finished run),
//! so the sensitivities are those that the batch fit sees: no observer, no analysis in between. Observed values are used only
//! to know which rows count; their size plays no role. The study is not changed. Next files to read: [`ensemble`], then
//! [`result`]; the arithmetic is `identifiability` in `starlings-estimators`.

pub mod advice;
pub mod at;
pub mod ensemble;
pub(super) mod error;
pub mod gather;
pub mod result;
pub mod series;
pub mod words;

pub use at::At;
pub use error::IdentifyError;
pub use result::Identification;

use starlings_estimators::Sensitivities;
use starlings_fleet::Fleet;

use super::fit::runner::EnsembleRunner;
use super::{Stage, Study, Work, constants};

/// Runs one ensemble of the study around a point and returns what its data could determine. `watch` hears of every stage as it begins.
///
/// # Errors
/// When the point is no point of this study, the fleet fails, or the model fails next to the point.
pub fn identify(
    study: &Study,
    fleet: &mut dyn Fleet,
    at: &At,
    watch: &mut dyn FnMut(&Stage),
) -> Result<Identification, IdentifyError> {
    let centre = at.centre(study)?;
    let mut runner = EnsembleRunner::new(study, fleet)?;
    // Runs of every trained record, all of them as long.
    let records = study.trained_windows().len() as f64;
    let (beside, constants) = ((2 * study.parameters.len() + 1) as f64, constants::n_run(study) as f64);
    let total = records * (beside + constants);
    let mut tell = |runner: &EnsembleRunner<'_>, name, says: String, [done, next]: [f64; 2]| {
        let work = Work::of_runs(records * done, records * next, total);
        watch(&Stage { name, says, runs: runner.counts.total, workers: runner.n_workers(), work });
    };
    let n = study.parameters.len();
    tell(&runner, "sensitivities", format!("{n} parameters moved"), [0.0, beside]);
    let response = ensemble::run(&mut runner, &centre)?;
    let prior_sd: Vec<f64> = study.theta.iter().map(|t| t.prior_sd).collect();
    let spread = ensemble::spread(study);
    let sensitivities = Sensitivities::new(&response.whitened, &prior_sd, ensemble::accuracy(spread))?;
    if constants > 0.0 {
        // One of them moves none.
        tell(&runner, "constants", format!("{} moved", constants - 1.0), [beside, constants]);
    }
    let hangs_on = constants::of_ensemble(&mut runner, &centre, &response, &sensitivities)?;
    let mut result = gather::make(study, at, &centre, response, &sensitivities)?;
    result.hangs_on = hangs_on;
    result.workers = runner.n_answered();
    result.spread = spread;
    result.warnings = advice::warnings(study, &result);
    result.advice = advice::advice(&result);
    Ok(result)
}
