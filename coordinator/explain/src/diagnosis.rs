//! The diagnosis of one set of recordings, measured or simulated: the fit of the model as it is, the search, the verdict.
//!
//! The search begins with white noise of the stated size. Where the best supported version shows that the noise is correlated, all
//! of it is done again in units of that noise ([`crate::rounds`]).
//!
//! Next files to read: [`crate::refit::search`], [`crate::judge::verdict`].

use std::cell::OnceCell;

use nalgebra::DVector;
use starlings_estimators::End;
use starlings_study::{Record, Study};

use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::drive::drive;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::fit::model_variant::ModelVariant;
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict, decide, limits};
use crate::locate::{self, Track, UnknownInput};
use crate::options::Options;
use crate::refit::further::{search_further, search_generic_pairs};
use crate::refit::other_forms::{search_other_forms, sole_effect};
use crate::refit::search::{first_kinds, search};
use crate::refit::twins::refit_twins;
use crate::rounds::Rounds;
use crate::run_cache::{Course, Point, RunCache};
use crate::screen::candidates::candidates;
use crate::screen::proposals::{self, Proposals};
use crate::screen::residual_timing::Timing;
use crate::screen::resolve::{kinded, resolved_candidates};
use crate::tell::stand::stand;

/// A search with its verdict.
pub(super) struct Diagnosis<'a, 'c> {
    pub(super) found: SearchResult<'c>,
    pub(super) candidates: &'a [Candidate],
    pub(super) decision: Decision,
    pub(super) tracks: &'a [Track],
    /// The unknown input of every equation, at the model as it is; empty where there is no gap.
    pub(super) forces: Vec<UnknownInput>,
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
    let mut rounds = Rounds::default();
    let defs = candidates(study, options)?;
    foresee(cache, &kinded(study, defs.iter().cloned()), options);
    loop {
        let base = fit_as_it_is(cache, study, rounds.start(), options)?;
        rounds.begin(base.z());
        cache.stage("locate", "where simulation and data disagree");
        let tracks = cache.tracks(&Point { study, theta: base.theta() })?;
        let timing = Timing::of(&cache.rows, &base.predicted);
        let candidates = resolved_candidates(study, &defs, &tracks, &timing);
        foresee(cache, &candidates, options);
        let proposed = OnceCell::new();
        let mut found = search(cache, base, &candidates, &tracks, options)?;
        cache.stage("verdict", "");
        if let Some(noise) = rounds.another_noise(cache, &found) {
            // As many runs again as all searches so far.
            if cache.affords_runs(cache.runs()) {
                cache.rows.noise = noise;
                continue;
            }
            found.cut_short = true;
        }
        let (decision, forces) = decide_further(cache, &mut found, &candidates, &proposed, &tracks, options)?;
        if !rounds.stands(&found, &decision)
            && let Some(rows) = rounds.after_nothing(cache, &found)
        {
            cache.rows = rows;
            continue;
        }
        cache.foreseen.goes(Course::Over);
        let candidates = proposed.get().unwrap_or(&candidates);
        return then(cache, Diagnosis { found, candidates, decision, tracks: &tracks, forces });
    }
}

/// How much there is to screen first.
fn foresee(cache: &mut RunCache<'_>, candidates: &[Candidate], options: &Options) {
    let tried = || candidates.iter().filter(|c| first_kinds(options).contains(&c.kind));
    cache.foreseen.candidates(tried().count(), tried().map(|c| c.points.len()).sum());
}

/// Decides, refits what cannot be told from it to first order, and goes on with generic terms, with proposals and with pairs while nothing
/// explains the gap, or with other forms of what explains it.
/// `proposed` takes the candidates with the proposals, where any are made. With the decision come the unknown inputs of the model as it is.
fn decide_further<'c>(
    cache: &mut RunCache<'_>,
    found: &mut SearchResult<'c>,
    candidates: &'c [Candidate],
    proposed: &'c OnceCell<Vec<Candidate>>,
    tracks: &[Track],
    options: &Options,
) -> Result<(Decision, Vec<UnknownInput>), ExplainError> {
    let mut decision = decide(cache, found, candidates)?;
    if let Some(told) = decision.best.filter(|_| decision.verdict == Verdict::Tie)
        && refit_twins(cache, found, candidates, tracks, options, told)?
    {
        decision = decide(cache, found, candidates)?;
    }
    if let Some(wanted) = wanted_of_generic(found, &decision)
        && search_further(cache, found, candidates, tracks, options, (&[Kind::Generic], wanted))?
    {
        decision = decide(cache, found, candidates)?;
    }
    if decision.verdict == Verdict::NoGap {
        return Ok((decision, Vec::new()));
    }
    let forces = forces(cache, &found.base)?;
    if decision.verdict == Verdict::Unexplained && proposals::are_wanted(found.base.variant.base, options) {
        let made = made(found, candidates, tracks, &forces);
        if !made.candidates.is_empty() {
            found.looked_at = made.looked_at();
            let all = proposed.get_or_init(|| candidates.iter().cloned().chain(made.candidates).collect());
            search_further(cache, found, all, tracks, options, (&[Kind::Proposal], 0.0))?;
            cache.stage("verdict", "");
            decision = decide(cache, found, all)?;
        }
    } else if let Some(named) = decision.best.filter(|named| sole_effect(&found.judged[*named]).is_some())
        && proposals::are_wanted(found.base.variant.base, options)
    {
        let made = in_place_of(found, named, candidates, tracks, &forces);
        found.looked_at = made.looked_at();
        let all = proposed.get_or_init(|| candidates.iter().cloned().chain(made.candidates).collect());
        if search_other_forms(cache, found, all, tracks, options, named)? {
            cache.stage("verdict", "");
            decision = decide(cache, found, all)?;
        }
    }
    if decision.verdict == Verdict::Unexplained {
        let all = proposed.get().map_or(candidates, Vec::as_slice);
        if search_generic_pairs(cache, found, all, tracks, options)? {
            decision = decide(cache, found, all)?;
        }
    }
    Ok((decision, forces))
}

/// The unknown input of every equation, at the model as it is.
fn forces(cache: &mut RunCache<'_>, base: &FittedVariant<'_>) -> Result<Vec<UnknownInput>, ExplainError> {
    cache.stage("locate", "the unknown input of every equation");
    let study = &base.variant.study;
    let most = locate::MOST_RUNS + 2 * study.spec.states.len();
    if !cache.affords_runs(most as u64) {
        return Ok(Vec::new());
    }
    let mut runs = 0;
    let forces = locate::unknown_inputs(study, cache.fleet(), base.theta().as_slice(), &mut runs)?;
    cache.count(runs);
    Ok(forces)
}

/// The terms that may stand in place of what is told, without a run. An effect of a field stands for a dependence in its own equation; what is of
/// no field, and an instrument's error, may be any dependence in the equations that the data feel most.
fn in_place_of(
    found: &SearchResult<'_>,
    named: usize,
    known: &[Candidate],
    tracks: &[Track],
    forces: &[UnknownInput],
) -> Proposals {
    let judged = &found.judged[named];
    let Some(effect) = sole_effect(judged) else { return Proposals::default() };
    if !effect.candidate.kind.is_of_a_field() {
        return made(found, known, tracks, forces);
    }
    let (study, theta) = first_trained(found);
    let values = judged.fit.values_of(0);
    proposals::in_place_of(study, &theta, tracks, (effect.candidate, &values[1..]), known)
}

/// The study of the model as it is, and its parameters in the first trained record.
fn first_trained<'f>(found: &'f SearchResult<'_>) -> (&'f Study, Vec<f64>) {
    let study = &found.base.variant.study;
    let record = study.records.iter().position(Record::is_trained).unwrap_or(0);
    (study, study.theta_for(record, found.base.theta().as_slice()))
}

/// The terms that predict the unknown inputs.
fn made(
    found: &SearchResult<'_>,
    known: &[Candidate],
    tracks: &[Track],
    forces: &[UnknownInput],
) -> Proposals {
    let (study, theta) = first_trained(found);
    proposals::proposals(study, &theta, tracks, forces, known)
}

/// The fall of χ² that a generic term must promise to be tried: none where nothing explains the gap, or what does is an instrument's error or
/// an effect at a limit of a parameter inside it, which may be a simpler term; as much as what explains it where that leaves more than noise,
/// all of which a dependence may account for. Otherwise they are not tried.
fn wanted_of_generic(found: &SearchResult<'_>, decision: &Decision) -> Option<f64> {
    match decision.verdict {
        Verdict::Unexplained => Some(0.0),
        Verdict::Named | Verdict::Tie => {
            let judged = &found.judged[decision.best?];
            let is_doubtful = judged.kinds().contains(&Kind::Instrument) || !limits(judged).is_empty();
            let leaves = judged.adequacy.is_gap_of_the_model() && judged.adequacy.rmse_over_noise > 1.0;
            is_doubtful.then_some(0.0).or_else(|| leaves.then_some(judged.gain))
        }
        Verdict::NoGap => None,
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
        return Err(ExplainError::NotConverged { iterations: fit.trials(), stand: stand(&fit) });
    }
    fit.measure_own_values(cache)?;
    Ok(fit)
}
