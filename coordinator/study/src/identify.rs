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
use super::{Study, constants};

/// Runs one ensemble of the study around a point and returns what its data could determine.
///
/// # Errors
/// When the point is no point of this study, the fleet fails, or the model fails next to the point.
pub fn identify(study: &Study, fleet: &mut dyn Fleet, at: &At) -> Result<Identification, IdentifyError> {
    let centre = at.centre(study)?;
    let mut runner = EnsembleRunner::new(study, fleet)?;
    let response = ensemble::run(&mut runner, &centre)?;
    let prior_sd: Vec<f64> = study.theta.iter().map(|t| t.prior_sd).collect();
    let spread = ensemble::spread(study);
    let sensitivities = Sensitivities::new(&response.whitened, &prior_sd, ensemble::accuracy(spread))?;
    let hangs_on = constants::of_ensemble(&mut runner, &centre, &response, &sensitivities)?;
    let mut result = gather::make(study, at, &centre, response, &sensitivities)?;
    result.hangs_on = hangs_on;
    result.workers = runner.n_answered();
    result.spread = spread;
    result.warnings = advice::warnings(study, &result);
    result.advice = advice::advice(&result);
    Ok(result)
}
