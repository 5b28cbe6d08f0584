//! One inquiry of the recordings, measured or simulated: the fit of the model as it is, the search, the verdict.
//!
//! Next files to read: [`super::search`], [`super::verdict`].

use starlings_estimators::End;
use starlings_study::Study;

use super::candidate::{self, Candidate};
use super::fit::{Fitted, drive};
use super::laboratory::{Laboratory, Point};
use super::locate::Track;
use super::rhythm::{jumps, rhythms};
use super::search::{Found, search};
use super::verdict::{Decision, decide};
use super::version::Version;
use super::words;
use super::{ExplainError, Options};

/// A search with its verdict.
pub(super) struct Answer<'a, 'c> {
    pub(super) found: Found<'c>,
    pub(super) candidates: &'a [Candidate],
    pub(super) decision: Decision,
    pub(super) tracks: &'a [Track],
}

/// Fits the model as it is, searches and decides; `then` makes of it what is wanted.
///
/// # Errors
/// When the fleet or the store fails, there is nothing to try, the model as it is cannot be fitted, or the budget ends before
/// it is.
pub(super) fn answered<R>(
    laboratory: &mut Laboratory<'_>,
    study: &Study,
    options: &Options,
    then: impl FnOnce(&mut Laboratory<'_>, Answer<'_, '_>) -> Result<R, ExplainError>,
) -> Result<R, ExplainError> {
    let base = fit_as_it_is(laboratory, study, options)?;
    laboratory.stage("locate", "where simulation and data disagree");
    let tracks = laboratory.tracks(&Point { study, theta: base.theta() })?;
    let (rhythms, jumps) =
        (rhythms(&laboratory.rows, &base.predicted), jumps(&laboratory.rows, &base.predicted));
    let candidates = candidate::all(study, &tracks, &rhythms, &jumps, options)?;
    let found = search(laboratory, base, &candidates, &tracks, options)?;
    laboratory.stage("verdict", "");
    let decision = decide(laboratory, &found, &candidates)?;
    then(laboratory, Answer { found, candidates: &candidates, decision, tracks: &tracks })
}

/// The fit of the model as it is, on the training rows.
fn fit_as_it_is<'c>(
    laboratory: &mut Laboratory<'_>,
    study: &'c Study,
    options: &Options,
) -> Result<Fitted<'c>, ExplainError> {
    laboratory.stage("fit", "the model as it is");
    let version = Version::new(study, Vec::new(), &[])?;
    let mut fits = [Fitted::from_prior(version)];
    if !drive(laboratory, &mut fits)? {
        return Err(laboratory.beyond_budget(study.parameters.len()));
    }
    let [mut fit] = fits;
    if fit.end() == Some(End::NoStart) {
        let reason = "no run succeeds at the prior median or next to it".to_owned();
        return Err(ExplainError::Baseline(reason));
    }
    if !fit.has_converged() && !options.force {
        return Err(ExplainError::NotConverged { iterations: fit.trials(), stand: words::stand(&fit) });
    }
    fit.measure_own_values(laboratory)?;
    Ok(fit)
}
