//! The whole explanation on a page: fit, locate, screen, refit, gates, verdict, add, show.
//!
//! Every stage runs the model on the fleet through one [`Laboratory`], which remembers each run; an explanation that was killed
//! is continued by doing the same again. Next file to read: [`super::inquiry`].

use std::sync::Arc;

use starlings_fleet::Fleet;
use starlings_models::ObserverDef;
use starlings_study::Study;
use starlings_study::store::Store;

use super::answer;
use super::background::inflation;
use super::candidate::Candidate;
use super::experiment::propose;
use super::fit::Fitted;
use super::inquiry::{Answer, answered};
use super::judge::Judged;
use super::laboratory::{Laboratory, Point};
use super::locate::{self, Located, Track, View};
use super::patch::explained_study;
use super::reach;
use super::refused;
use super::search::Found;
use super::verdict::Decision;
use super::warnings;
use super::words;
use super::{Context, ExplainError, Explanation, Figures, Findings, Options, Verdict, null};

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
    // Every run is free: nothing may pull a simulation to the data that it is judged by.
    let mut free = study.clone();
    free.setup.observer = ObserverDef::default();
    let budget = options.budget.or(study.explain.budget);
    let mut laboratory = Laboratory::new(&free, &mut *fleet, store, context, budget);
    laboratory.hold_at_most(options.hold);
    let (mut findings, predicted) = answered(&mut laboratory, &free, options, |laboratory, answer| {
        let predicted = Arc::clone(&answer.found.base.predicted);
        Ok((finish(laboratory, &answer)?, predicted))
    })?;
    drop(laboratory);
    if options.nulls > 0 {
        let nulls = null::measure(&free, &predicted, fleet, store, context, options)?;
        findings.explanation.runs += nulls.runs;
        findings.explanation.runs_by_stage.push(("null".to_owned(), nulls.runs));
        findings.explanation.false_alarm.nulls = Some(nulls);
        findings.explanation.wall_s = context.earlier_s + (context.clock)();
    }
    Ok(findings)
}

/// Where a fit disagrees with the data.
fn look(laboratory: &Laboratory<'_>, fit: &Fitted<'_>, tracks: &[Track]) -> Located {
    let sd = answer::prediction_sd(laboratory, fit);
    locate::locate(&View { prediction_sd: Some(&sd), ..view(laboratory, fit, tracks) })
}

fn view<'v>(laboratory: &'v Laboratory<'_>, fit: &'v Fitted<'_>, tracks: &'v [Track]) -> View<'v> {
    View {
        study: laboratory.study,
        rows: &laboratory.rows,
        predicted: &fit.predicted,
        prediction_sd: None,
        tracks,
        seed: laboratory.study.seed,
    }
}

/// Puts the findings together.
fn finish(laboratory: &mut Laboratory<'_>, answer: &Answer<'_, '_>) -> Result<Findings, ExplainError> {
    let Answer { found, candidates, decision, tracks } = answer;
    let mut before = look(laboratory, &found.base, tracks);
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    if decision.verdict != Verdict::NoGap {
        before.forces = forces(laboratory, &found.base)?;
    }
    laboratory.stage("add", "");
    let mut warnings = warnings::warnings(laboratory, found, decision);
    let explained = match added {
        Some(judged) => {
            let left_out = &judged.fit.version.left_out;
            match explained_study(laboratory.study, &answer::patches(judged), left_out, laboratory.folder()) {
                Ok(text) => Some(text),
                Err(error) => {
                    warnings.push(format!("no explained study was written: {error}"));
                    None
                }
            }
        }
        None => None,
    };
    let experiment = match (judged, decision.rivals.first()) {
        (Some(best), Some(rival)) => propose(laboratory, best, &found.judged[*rival], tracks)?,
        _ => None,
    };
    laboratory.stage("show", "");
    let figures = figures(laboratory, found, decision, &before)?;
    let mut explanation =
        explanation(laboratory, found, candidates, decision, &before, explained.is_some(), warnings);
    explanation.experiment = experiment;
    Ok(Findings { explanation, figures, explained_study: explained })
}

/// The unknown input of every equation, at the model as it is.
fn forces(
    laboratory: &mut Laboratory<'_>,
    base: &Fitted<'_>,
) -> Result<Vec<locate::UnknownInput>, ExplainError> {
    laboratory.stage("locate", "the unknown input of every equation");
    let study = &base.version.study;
    let most = locate::MOST_RUNS + 2 * study.spec.states.len();
    if !laboratory.affords_runs(most as u64) {
        return Ok(Vec::new());
    }
    let mut runs = 0;
    let theta = base.theta();
    let forces = locate::unknown_inputs(study, laboratory.fleet(), theta.as_slice(), &mut runs)?;
    laboratory.count(runs);
    Ok(forces)
}

fn figures(
    laboratory: &mut Laboratory<'_>,
    found: &Found<'_>,
    decision: &Decision,
    before: &Located,
) -> Result<Figures, ExplainError> {
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    let maps_after = match added {
        Some(judged) if laboratory.affords(1) => {
            let study = &judged.fit.version.study;
            let tracks = laboratory.tracks(&Point { study, theta: judged.fit.theta() })?;
            let view = view(laboratory, &judged.fit, &tracks);
            before.maps.iter().map(|map| locate::map_again(map, &view)).collect()
        }
        _ => Vec::new(),
    };
    let after = added.map(|j| j.fit.predicted.as_slice());
    let of_base = || inflation(&laboratory.rows, found.base.residual());
    let inflation = judged.map_or_else(of_base, |j| j.inflation);
    Ok(Figures {
        time_unit: laboratory.study.time_unit.clone(),
        curves: answer::curves(laboratory, &found.base.predicted, after),
        before: before.clone(),
        maps_after,
        null_gains: found.background.maxima.clone(),
        decoy_gains: found.background.decoys.iter().map(|d| d / inflation).collect(),
        best_gain: best_gain(found, judged) / inflation,
    })
}

/// Fall of χ² by what the decision rests on, or else the largest that the screening promised: what decoys are compared with.
fn best_gain(found: &Found<'_>, judged: Option<&Judged<'_>>) -> f64 {
    judged.map_or(found.alarm, |j| j.gain)
}

fn explanation(
    laboratory: &Laboratory<'_>,
    found: &Found<'_>,
    candidates: &[Candidate],
    decision: &Decision,
    before: &Located,
    explained: bool,
    warnings: Vec<String>,
) -> Explanation {
    let study = laboratory.study;
    let judged = decision.best.map(|i| &found.judged[i]);
    let added = judged.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    let checked = decision.checked.map(|i| &found.judged[i]);
    let n_train = laboratory.rows.train.len();
    let nearest = judged.or(found.judged.first());
    let after = added.map(|j| j.fit.predicted.as_slice());
    Explanation {
        study: study.name.clone(),
        model: study.setup.model.kind.clone(),
        seed: study.seed,
        verdict: decision.verdict,
        headline: words::headline(laboratory, found, candidates, decision),
        places: before.places.clone(),
        effects: added.map(answer::effects).unwrap_or_default(),
        replaced: added.map(|j| j.fit.version.left_out.clone()).unwrap_or_default(),
        tied_with: decision.tied.clone(),
        experiment: None,
        closest: nearest
            .filter(|_| decision.verdict == Verdict::Unexplained)
            .and_then(|j| answer::effects(j).into_iter().next()),
        screened: answer::screened(found, candidates, decision, n_train),
        rejected: refused::rejected(found, candidates, decision),
        gap: after.map(|y| answer::gap(laboratory, &found.base.predicted, y)).unwrap_or_default(),
        held_out: nearest.map_or(&found.held_out, |j| &j.held_out).clone(),
        not_tried: reach::not_tried(study, candidates),
        remaining: answer::remaining(found, added, checked, words::shape(found, added, before)),
        false_alarm: answer::false_alarm(found, best_gain(found, judged)),
        parameter_shifts: added.map(|j| answer::shifts(&found.base, j)).unwrap_or_default(),
        untried: words::untried(found, candidates),
        explained_study: explained.then(|| "explained.toml".to_owned()),
        conditional_on: words::conditional_on(added),
        runs: laboratory.runs(),
        runs_by_stage: laboratory.runs_by_stage(),
        workers: laboratory.n_answered(),
        wall_s: laboratory.elapsed(),
        warnings: [study.warnings.clone(), warnings].concat(),
    }
}
