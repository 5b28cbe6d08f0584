//! The sequential fit: passes of a filter over the training windows, one ensemble per step.
//!
//! What differs from pass to pass is in [`super::schedule`], when they end in [`super::settle`]; the sigma-point arithmetic
//! lives in `starlings-estimators`; model states are only recombined here. Next file to read: [`super::schedule`], then
//! [`super::rescue`].

use starlings_estimators::{Analysis, Data, MakeFilter, Particles};

use super::drifting::{self, Before};
use super::ensemble::{noise, recombine};
use super::resample;
use super::rescue::{Forecast, forecast};
use super::runner::{AnalysisIndex, EnsembleRunner, StepWindows};
use super::schedule::{Reported, Schedule, particles};
use super::settle;
use super::stack::{stack_outputs, stack_states};
use crate::store::snapshot::{Ensemble, Snapshot};
use crate::store::{AnalysisRow, InnovationRow, Store};
use crate::work::settling::{More, Settling};
use crate::{Fit, Move, RunContext, RunError, Study, posterior};

/// Runs every pass of the filter that `make` gives, continuing from `resumed` if there is one.
///
/// # Errors
/// When the fleet or the store fails, or too few sigma points can be run.
pub(crate) fn fit(
    make: MakeFilter,
    runner: &mut EnsembleRunner<'_>,
    store: &Store,
    context: &mut RunContext<'_>,
    resumed: Option<Snapshot>,
) -> Result<Fit, RunError> {
    let study = runner.study();
    let schedule = Schedule::new(study, make)?;
    let mut now = match resumed {
        Some(snapshot) => {
            runner.recall(snapshot.figures.failures.clone());
            snapshot.of_filter(store)?
        }
        None => schedule.start(0, &posterior::prior(study)),
    };
    let mut reported = schedule.reported(&now)?;
    let mut settling = Settling::default();
    // Passes after the one that goes on.
    let mut later = More::Usual;
    loop {
        if now.figures.step == 0 {
            context.stands(&schedule.progress(&now, later, runner));
        }
        while now.figures.step < schedule.n_step() {
            store.keep_inputs(&now)?;
            let (row, next) = step(runner, &schedule, &mut now, &reported)?;
            reported = next;
            store.analysis(&row, &now)?;
            let is_over = now.figures.step == schedule.n_step();
            if let Some(moved) = schedule.last_move(&now, &reported).filter(|_| is_over) {
                settling.step(moved.size);
                later = settling.more(Move::SETTLED);
            }
            context.after_step(store, &schedule.progress(&now, later, runner))?;
        }
        let before_runs = runner.counts;
        let next = settle::next(runner, &schedule, &now, &reported)?;
        now.figures.counts.add_since(before_runs, runner.counts);
        let Some(mut next) = next else { return Ok(schedule.finish(&now, reported)) };
        next.figures.counts = now.figures.counts;
        next.figures.information_lost = now.figures.information_lost;
        next.figures.dropped = now.figures.dropped;
        now = next;
        reported = schedule.reported(&now)?;
        later = later.later();
    }
}

/// Predict, observe, analyse, recombine: one step of the filter over every record that still has data. Returns what the
/// store keeps of it and what is known after it; `before` is what was known before.
pub(super) fn step(
    runner: &mut EnsembleRunner<'_>,
    schedule: &Schedule<'_>,
    now: &mut Snapshot<Ensemble>,
    before: &Reported,
) -> Result<(AnalysisRow, Reported), RunError> {
    let windows = schedule.step_windows(now.figures.step);
    let at = AnalysisIndex { pass: now.figures.pass + 1, step: now.figures.step };
    let filter = &*schedule.filter;
    let before_runs = runner.counts;
    let Forecast { mut particles, results, rescued } =
        forecast(runner, filter, particles(now), &mut now.states, &windows, at)?;
    for (index, (record, _)) in windows.iter().enumerate() {
        now.states[*record] = Some(stack_states(&results, index)?);
    }
    if let Some(walking) = schedule.walking(now.figures.pass) {
        walking.follow(&mut particles.theta, &now.states)?;
    }
    let mut predictions = stack_outputs(&results, &windows);
    if schedule.resample && rescued == 0 {
        let states = &mut now.states;
        let drawn = resample::redraw(runner, filter, at, &windows, &particles, &predictions, states)?;
        if let Some(redrawn) = drawn {
            if let Some(from) = &mut now.estimate.from_start {
                from.redrawn(filter, &particles, &redrawn.transform);
            }
            (particles, predictions) = (redrawn.particles, redrawn.predictions);
            now.figures.dropped = now.figures.dropped.max(redrawn.dropped);
        }
    }
    let values: Vec<f64> = windows.iter().flat_map(|(_, w)| w.observed.iter().copied()).collect();
    let noise = noise(schedule.study, &windows, schedule.anneal(now.figures.pass));
    let (after, mut analysis) =
        filter.analysis(&particles, &predictions, &Data { values: &values, noise: &noise })?;
    let before_it = Before { particles: &particles, predictions: &predictions };
    let particles = drifting::go_on(schedule, filter, now, &before_it, after, &mut analysis)?;
    recombine(&mut now.states, &analysis.transform, runner)?;
    for (record, states) in now.states.iter_mut().enumerate() {
        if schedule.windows[record].len() <= at.step + 1 {
            *states = None;
        }
    }
    advance(now, &particles, &analysis);
    now.figures.counts.add_since(before_runs, runner.counts);
    now.figures.counts.rescued += rescued;
    now.figures.failures = runner.learned();
    let after = schedule.reported(now)?;
    let mut row = row(schedule.study, at, &windows, &analysis, before, &after);
    row.jobs = runner.take_rows();
    Ok((row, after))
}

fn advance(now: &mut Snapshot<Ensemble>, particles: &Particles, analysis: &Analysis) {
    now.estimate.theta = (&particles.theta).into();
    now.figures.step += 1;
    now.figures.nis += analysis.nis;
    now.figures.n_used += analysis.n_used;
    now.figures.log_likelihood += analysis.log_likelihood;
    now.figures.information_lost = now.figures.information_lost.max(analysis.information_lost);
}

fn row(
    study: &Study,
    at: AnalysisIndex,
    windows: &StepWindows,
    analysis: &Analysis,
    before: &Reported,
    after: &Reported,
) -> AnalysisRow {
    AnalysisRow {
        pass: at.pass,
        step: at.step,
        time: elapsed(study, windows),
        n_used: analysis.n_used,
        nis: after.nis - before.nis,
        log_likelihood: after.log_likelihood - before.log_likelihood,
        information_lost: analysis.information_lost,
        estimates: posterior::rows(study, &after.posterior),
        innovations: innovations(study, windows, analysis),
        jobs: Vec::new(),
    }
}

/// Longest time since a record's start among the step's windows.
fn elapsed(study: &Study, windows: &StepWindows) -> f64 {
    windows
        .iter()
        .filter_map(|(record, w)| Some(w.times.last()? - study.records[*record].start))
        .fold(0.0, f64::max)
}

fn innovations(study: &Study, windows: &StepWindows, analysis: &Analysis) -> Vec<InnovationRow> {
    let mut rows = Vec::new();
    let mut at = 0;
    for (record, window) in windows {
        for time in &window.times {
            for output in &study.setup.outputs {
                if analysis.innovation[at].is_finite() {
                    rows.push(InnovationRow {
                        record: study.records[*record].name.clone(),
                        output: output.clone(),
                        time: *time,
                        innovation: analysis.innovation[at],
                        sd: analysis.innovation_sd[at],
                    });
                }
                at += 1;
            }
        }
    }
    rows
}
