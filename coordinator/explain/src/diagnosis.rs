//! The diagnosis of one set of recordings, measured or simulated: the fit of the model as it is, the search, the verdict.
//!
//! The search begins with white noise of the stated size. Where the best supported version shows that the noise is correlated, all
//! of it is done again in units of that noise.
//!
//! Next files to read: [`crate::refit::search`], [`crate::judge::verdict`].

use nalgebra::DVector;
use starlings_estimators::End;
use starlings_study::Study;

use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::drive::drive;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::fit::model_variant::ModelVariant;
use crate::judge::noise_model::{alike, best_supported};
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict, decide};
use crate::locate::Track;
use crate::options::Options;
use crate::refit::search::{search, search_generic};
use crate::run_cache::{Point, RunCache};
use crate::screen::residual_timing::{change_points, periods};
use crate::screen::resolve::resolved_candidates;
use crate::tell::words;

/// Searches at most, each in units of the noise that the last one showed.
const ROUNDS: usize = 3;

/// A search with its verdict.
pub(super) struct Diagnosis<'a, 'c> {
    pub(super) found: SearchResult<'c>,
    pub(super) candidates: &'a [Candidate],
    pub(super) decision: Decision,
    pub(super) tracks: &'a [Track],
}

/// Fits the model as it is, searches and decides, and returns what `then` makes of the diagnosis.
///
/// # Errors
/// When the fleet or the store fails, there is nothing to try, the model as it is cannot be fitted, or the budget ends before
/// it is.
pub(super) fn diagnose<R>(
    cache: &mut RunCache<'_>,
    study: &Study,
    options: &Options,
    then: impl FnOnce(&mut RunCache<'_>, Diagnosis<'_, '_>) -> Result<R, ExplainError>,
) -> Result<R, ExplainError> {
    let mut start = None;
    for round in 1.. {
        let base = fit_as_it_is(cache, study, start, options)?;
        start = Some(base.z().clone());
        cache.stage("locate", "where simulation and data disagree");
        let tracks = cache.tracks(&Point { study, theta: base.theta() })?;
        let (periods, change_points) =
            (periods(&cache.rows, &base.predicted), change_points(&cache.rows, &base.predicted));
        let candidates = resolved_candidates(study, &tracks, &periods, &change_points, options)?;
        let mut found = search(cache, base, &candidates, &tracks, options)?;
        cache.stage("verdict", "");
        let noise = best_supported(cache, &found);
        let goes_on = round < ROUNDS && !noise.is_empty() && !alike(&noise, &cache.rows.noise);
        // As many runs again as all searches so far.
        let is_afforded = cache.affords_runs(cache.runs());
        if !(goes_on && is_afforded) {
            found.cut_short |= goes_on;
            let mut decision = decide(cache, &found, &candidates)?;
            if is_open(&found, &decision) && search_generic(cache, &mut found, &candidates, &tracks, options)?
            {
                decision = decide(cache, &found, &candidates)?;
            }
            return then(cache, Diagnosis { found, candidates: &candidates, decision, tracks: &tracks });
        }
        cache.rows.noise = noise;
    }
    unreachable!("the last round returns")
}

/// Whether generic terms are tried: nothing explains the gap, or an instrument's error is all that does.
fn is_open(found: &SearchResult<'_>, decision: &Decision) -> bool {
    let instrument = |i: usize| found.judged[i].kinds().contains(&Kind::Instrument);
    match decision.verdict {
        Verdict::Unexplained => true,
        Verdict::Named | Verdict::Tie => decision.best.is_some_and(instrument),
        Verdict::NoGap => false,
    }
}

/// The fit of the model as it is, on the training rows, from where it stood with another noise.
fn fit_as_it_is<'c>(
    cache: &mut RunCache<'_>,
    study: &'c Study,
    start: Option<DVector<f64>>,
    options: &Options,
) -> Result<FittedVariant<'c>, ExplainError> {
    cache.stage("fit", "the model as it is");
    let variant = ModelVariant::new(study, Vec::new(), &[])?;
    let start = start.unwrap_or_else(|| DVector::zeros(variant.n_param()));
    let mut fits = [FittedVariant::begin(variant, start)];
    if !drive(cache, &mut fits)? {
        return Err(cache.beyond_budget(study.parameters.len()));
    }
    let [mut fit] = fits;
    if fit.end() == Some(End::NoStart) {
        let reason = "no run succeeds at the prior median or next to it".to_owned();
        return Err(ExplainError::Baseline(reason));
    }
    if !fit.has_converged() && !options.force {
        return Err(ExplainError::NotConverged { iterations: fit.trials(), stand: words::stand(&fit) });
    }
    fit.measure_own_values(cache)?;
    Ok(fit)
}
