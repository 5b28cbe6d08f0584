//! The whole explanation on a page: fit, locate, screen, refit, gates, verdict, add, show.
//!
//! Every stage runs the model on the fleet through one [`RunCache`], which remembers each run; an explanation that was killed
//! is continued by the same workflow, which finds its earlier runs in the database. Next file to read: [`crate::diagnosis`].

use std::sync::Arc;

use starlings_fleet::Fleet;
use starlings_models::ObserverDef;
use starlings_study::store::Store;
use starlings_study::{Record, Study};

use crate::diagnosis::{Diagnosis, diagnose};
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::prediction_sd::prediction_sd;
use crate::judge::effective_noise::inflation;
use crate::judge::gates::{JudgedFit, Refusal};
use crate::judge::probability::probabilities;
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict};
use crate::locate;
use crate::locate::{Located, Track, View};
use crate::null_recordings;
use crate::options::{Context, Options};
use crate::run_cache::{Point, RunCache};
use crate::screen::{not_tried, proposals};
use crate::tell::correlated::correlated_noise;
use crate::tell::experiment::propose;
use crate::tell::figures::Figures;
use crate::tell::findings::Findings;
use crate::tell::patch::explained_study;
use crate::tell::result::Explanation;
use crate::tell::{rejected, summary, warnings, words};

/// Explains a study's misfit.
///
/// # Errors
/// When the fleet or the store fails, there is nothing to try, the model as it is cannot be fitted, or the budget ends before
/// it is.
pub fn explain(
    study: &Study,
    fleet: &mut dyn Fleet,
    store: &Store,
    context: &mut Context<'_>,
    options: &Options,
) -> Result<Findings, ExplainError> {
    // Every run is made without an observer, which would pull the simulation towards the data that it is compared with.
    let mut free = study.clone();
    free.setup.observer = ObserverDef::default();
    let budget = options.budget.or(study.explain.budget);
    let mut cache = RunCache::new(&free, &mut *fleet, store, context, budget);
    cache.hold_at_most(options.hold);
    cache.foreseen.nulls(options.nulls);
    let (mut findings, fitted) = diagnose(&mut cache, &free, options, |cache, diagnosis| {
        let fitted = (Arc::clone(&diagnosis.found.base.predicted), cache.rows.clone());
        Ok((finish(cache, &diagnosis)?, fitted))
    })?;
    let foreseen = cache.foreseen.clone();
    drop(cache);
    if options.nulls > 0 {
        let nulls = null_recordings::measure(&free, (&fitted, &foreseen), fleet, store, context, options)?;
        findings.explanation.runs += nulls.runs;
        findings.explanation.runs_by_stage.push(("null".to_owned(), nulls.runs));
        findings.explanation.false_alarm.nulls = Some(nulls);
        findings.explanation.wall_s = context.earlier_s + (context.clock)();
    }
    Ok(findings)
}

/// Where a fit disagrees with the data.
fn look(cache: &RunCache<'_>, fit: &FittedVariant<'_>, tracks: &[Track]) -> Located {
    let sd = prediction_sd(cache, fit);
    locate::locate(&View { prediction_sd: Some(&sd), ..view(cache, fit, tracks) })
}

fn view<'v>(cache: &'v RunCache<'_>, fit: &'v FittedVariant<'_>, tracks: &'v [Track]) -> View<'v> {
    View {
        study: cache.study,
        rows: &cache.rows,
        predicted: &fit.predicted,
        prediction_sd: None,
        tracks,
        seed: cache.study.seed,
    }
}

/// Puts the findings together.
fn finish(cache: &mut RunCache<'_>, diagnosis: &Diagnosis<'_, '_>) -> Result<Findings, ExplainError> {
    let Diagnosis { found, candidates, decision, tracks, forces } = diagnosis;
    let mut before = look(cache, &found.base, tracks);
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    before.forces = with_terms(forces, found, added, tracks);
    cache.stage("add", "");
    let mut warnings = warnings::warnings(cache, found, candidates, decision);
    warnings.extend(cache.told_of_workers()?);
    let explained = match added {
        Some(judged) => {
            let left_out = &judged.fit.variant.left_out;
            match explained_study(cache.study, &summary::patches(judged), left_out, cache.folder()) {
                Ok(text) => Some(text),
                Err(error) => {
                    warnings.push(format!("no explained study was written: {error}"));
                    None
                }
            }
        }
        None => None,
    };
    let experiment = match to_separate(found, decision) {
        Some(versions) => propose(cache, versions, tracks)?,
        None => None,
    };
    cache.stage("show", "");
    let figures = figures(cache, found, decision, &before)?;
    let mut explanation =
        explanation(cache, found, candidates, decision, &before, explained.is_some(), warnings);
    explanation.experiment = experiment;
    Ok(Findings { explanation, figures, explained_study: explained })
}

/// The unknown inputs with what the effects that were added give in their place.
fn with_terms(
    forces: &[locate::UnknownInput],
    found: &SearchResult<'_>,
    added: Option<&JudgedFit<'_>>,
    tracks: &[Track],
) -> Vec<locate::UnknownInput> {
    let mut forces = forces.to_vec();
    let Some(judged) = added else { return forces };
    let study = &found.base.variant.study;
    let record = study.records.iter().position(Record::is_trained).unwrap_or(0);
    let theta = study.theta_for(record, found.base.theta().as_slice());
    let values =
        summary::effects(judged).into_iter().map(|e| e.parameters.iter().map(|p| p.estimate).collect());
    let effects: Vec<(&Candidate, Vec<f64>)> =
        judged.fit.variant.effects.iter().map(|e| e.candidate).zip(values).collect();
    for force in &mut forces {
        force.proposed = proposals::along(study, &theta, tracks, &effects, force);
    }
    forces
}

/// The versions that an experiment should separate: the tied, or the two that come nearest where nothing is named, of which the model as
/// it is may be one. A version with a coefficient at the end of its range is none.
fn to_separate<'f, 'c>(
    found: &'f SearchResult<'c>,
    decision: &Decision,
) -> Option<[&'f FittedVariant<'c>; 2]> {
    match decision.verdict {
        Verdict::Tie => Some([decision.best?, *decision.rivals.first()?].map(|i| &found.judged[i].fit)),
        Verdict::Unexplained => {
            let is_possible = |j: &&JudgedFit<'_>| !j.refusal.as_ref().is_some_and(Refusal::is_impossible);
            let best = decision.best.map(|i| &found.judged[i]);
            let others = found.judged.iter().filter(is_possible);
            let others = others.filter(|j| best.is_none_or(|b| b.names() != j.names()));
            let mut versions = best.into_iter().chain(others).map(|j| &j.fit).chain([&found.base]);
            Some([versions.next()?, versions.next()?])
        }
        Verdict::Named | Verdict::NoGap => None,
    }
}

fn figures(
    cache: &mut RunCache<'_>,
    found: &SearchResult<'_>,
    decision: &Decision,
    before: &Located,
) -> Result<Figures, ExplainError> {
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    let maps_after = match added {
        Some(judged) if cache.affords(1) => {
            let study = &judged.fit.variant.study;
            let tracks = cache.tracks(&Point { study, theta: judged.fit.theta() })?;
            let view = view(cache, &judged.fit, &tracks);
            before.maps.iter().map(|map| locate::map_again(map, &view)).collect()
        }
        _ => Vec::new(),
    };
    let after = added.map(|j| j.fit.predicted.as_slice());
    let of_base = || inflation(&cache.rows, found.base.residual());
    let inflation = judged.map_or_else(of_base, |j| j.inflation);
    Ok(Figures {
        time_unit: cache.study.time_unit.clone(),
        curves: summary::curves(cache, &found.base.predicted, after),
        before: before.clone(),
        maps_after,
        null_gains: found.null_distribution.maxima.clone(),
        decoy_gains: found.null_distribution.decoys.iter().map(|d| d / inflation).collect(),
        best_gain: best_gain(found, judged) / inflation,
    })
}

/// Fall of χ² by the variant on which the decision rests, or else the largest of the screening; decoys are compared with it.
fn best_gain(found: &SearchResult<'_>, judged: Option<&JudgedFit<'_>>) -> f64 {
    judged.map_or(found.largest_gain, |j| j.gain)
}

fn explanation(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
    before: &Located,
    explained: bool,
    warnings: Vec<String>,
) -> Explanation {
    let study = cache.study;
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    let checked = decision.checked.map(|i| &found.judged[i]);
    let n_train = cache.rows.train.len();
    let nearest = judged.or(found.judged.first());
    let before_all = &found.base.predicted;
    let after = nearest.map_or(before_all, |j| &j.fit.predicted);
    let is_name = |set: &Vec<String>| set.iter().all(|name| candidates.iter().any(|c| c.name() == name));
    let (tied, forms): (Vec<_>, Vec<_>) = decision.tied.iter().cloned().partition(is_name);
    Explanation {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        seed: study.seed,
        verdict: decision.verdict,
        headline: words::headline(cache, found, candidates, decision),
        probabilities: probabilities(&cache.rows, found, candidates, decision),
        places: before.places.clone(),
        effects: added.map(summary::effects).unwrap_or_default(),
        replaced: added.map(|j| j.fit.variant.left_out.clone()).unwrap_or_default(),
        tied_gap: summary::tied_gap(cache, found, &tied),
        tied_with: tied,
        tied_forms: forms.concat(),
        experiment: None,
        closest: nearest
            .filter(|_| decision.verdict == Verdict::Unexplained)
            .map(summary::effects)
            .unwrap_or_default(),
        screened: summary::screened(found, candidates, decision, n_train),
        rejected: rejected::rejected(found, candidates, decision),
        gap: summary::gap(cache, before_all, after),
        held_out: nearest.map_or(&found.held_out, |j| &j.held_out).clone(),
        not_tried: not_tried::not_tried(study, candidates),
        correlated_noise: correlated_noise(study, &cache.rows),
        remaining: summary::remaining(found, added, checked, words::shape(found, added, before)),
        false_alarm: summary::false_alarm(found, best_gain(found, judged)),
        parameter_shifts: added.map(|j| summary::shifts(&found.base, j)).unwrap_or_default(),
        untried: words::untried(found, candidates),
        explained_study: explained.then(|| "explained.toml".to_owned()),
        conditional_on: words::conditional_on(added),
        runs: cache.runs(),
        runs_by_stage: cache.runs_by_stage(),
        workers: cache.n_answered(),
        wall_s: cache.elapsed(),
        warnings: [study.warnings.clone(), warnings::of_candidates(study, candidates), warnings].concat(),
    }
}
