//! The batch fit: iterated Gauss–Newton over whole-record runs, one iteration = one ensemble, or one run that gives its slopes.
//!
//! For solvers that cannot restart from a state, and as a reference for the filter: every run starts at its record's start,
//! so no linear mixture of states is ever used. Next file to read: the `batch` module of `starlings-estimators`.

use std::sync::Arc;

use nalgebra::DMatrix;
use starlings_estimators::{Batch, BatchStep, Block, Data, EstimatorError, SigmaSet};
use starlings_models::Window;

use super::ensemble::noise;
use super::runner::{AnalysisIndex, EnsembleRunner, Results, StepWindows};
use super::slopes;
use super::stack::stack_outputs;
use crate::store::snapshot::{Figures, Iteration, Snapshot};
use crate::store::{AnalysisRow, Store};
use crate::work::plan::{self, WorkPlan};
use crate::work::settling::{More, Settling};
use crate::{Fit, Progress, RunContext, RunError, Study, posterior};

/// Iterates to the posterior mode, continuing from `resumed` if there is one.
///
/// # Errors
/// When the fleet or the store fails, or no run around the estimate succeeds.
pub(crate) fn fit(
    runner: &mut EnsembleRunner<'_>,
    store: &Store,
    context: &mut RunContext<'_>,
    resumed: Option<Snapshot>,
) -> Result<Fit, RunError> {
    let study = runner.study();
    let windows = study.trained_windows();
    let blocks = blocks(study, &windows);
    let n_point_param = blocks.first().map_or(study.theta.len(), |block| block.parameters.len());
    let batch = Batch {
        set: SigmaSet::new(study.estimator.points, n_point_param)?,
        blocks,
        max_iterations: study.estimator.max_iterations,
        tolerance: study.estimator.tolerance,
        spread: study.spread(),
    };
    let values: Vec<f64> = windows.iter().flat_map(|(_, w)| w.observed.iter().copied()).collect();
    let noise = noise(study, &windows, 1.0);
    let exact = study.estimator.kind.has_exact_slopes();
    let plan = WorkPlan::new(study, if exact { slopes::weight(study) } else { batch.set.n_particle() + 1 });
    let mut settling = Settling::default();
    let mut now = match resumed {
        Some(snapshot) => {
            runner.recall(snapshot.figures.failures.clone());
            snapshot.of_batch(store)?
        }
        None => begin(&batch, study),
    };
    if now.figures.step == 0 {
        context.stands(&progress(&now, (&batch, &plan), More::Usual, runner));
    }
    while !now.estimate.state.converged && now.figures.step < batch.max_iterations {
        let at = AnalysisIndex { pass: 1, step: now.figures.step };
        let points = batch.sample(&now.estimate.state);
        let theta = if exact { points.columns(0, 1).into_owned() } else { points };
        store.keep_points(at.step, &theta)?;
        let results = run_ensemble(runner, &mut now, at, &theta, &windows)?;
        let (predictions, failed) = match results.as_slice() {
            [centre] if exact => slopes::as_points(study, &batch, &now.estimate.state, centre, &windows),
            _ => gathered(&batch, &results, &windows),
        };
        let (next, step) = batch.step(
            &now.estimate.state,
            &predictions,
            &failed,
            &Data { values: &values, noise: &noise },
        )?;
        now.estimate = Iteration { state: next, posterior: step.posterior.clone() };
        advance(&mut now.figures, &step);
        let mut row = row(study, at, &step);
        row.jobs = runner.take_rows();
        store.analysis(&row, &now)?;
        settling.step(step.step);
        let more = if step.converged { More::Expected(0) } else { settling.more(batch.tolerance) };
        context.after_step(store, &progress(&now, (&batch, &plan), more, runner))?;
    }
    if now.figures.n_used == 0 {
        return Err(EstimatorError::StartFailed { attempt: now.figures.step }.into());
    }
    Ok(finish(now, plan))
}

/// The rows of each record with what all records share and the values of its own, where there are such: a record's own values
/// need no runs of the others. None for a study that shares everything, has one record to fit, or a record that takes a value from the
/// others since its first rows tell only where it starts.
fn blocks(study: &Study, windows: &StepWindows) -> Vec<Block> {
    if windows.len() < 2 || study.theta.iter().all(|entry| entry.record.is_none()) {
        return Vec::new();
    }
    let of = |record: Option<usize>| {
        let entries = study.theta.iter().enumerate();
        entries.filter(move |(_, entry)| entry.record == record).map(|(j, _)| j)
    };
    let mut end = 0;
    let block = |(record, window): &(usize, Arc<Window>)| {
        let first = end;
        end += window.observed.len();
        Block { rows: first..end, parameters: of(None).chain(of(Some(*record))).collect() }
    };
    let blocks: Vec<Block> = windows.iter().map(block).collect();
    let alike = blocks.iter().all(|block| block.parameters.len() == blocks[0].parameters.len());
    if alike { blocks } else { Vec::new() }
}

/// Predictions and which points failed. In blocks a run that failed counts against its own record alone: its values are no
/// numbers, and no point has failed as a whole.
fn gathered(batch: &Batch, results: &Results, windows: &StepWindows) -> (DMatrix<f64>, Vec<bool>) {
    if batch.blocks.is_empty() {
        let failed = results.iter().map(|of| of.iter().any(Result::is_err)).collect();
        return (stack_outputs(results, windows), failed);
    }
    let m = batch.blocks.last().map_or(0, |block| block.rows.end);
    let mut predictions = DMatrix::from_element(m, results.len(), f64::NAN);
    for (column, of_point) in results.iter().enumerate() {
        for (block, result) in batch.blocks.iter().zip(of_point) {
            if let Ok(prediction) = result {
                predictions
                    .view_mut((block.rows.start, column), (block.rows.len(), 1))
                    .copy_from_slice(&prediction.outputs);
            }
        }
    }
    (predictions, vec![false; results.len()])
}

fn begin(batch: &Batch, study: &Study) -> Snapshot<Iteration> {
    let prior = posterior::prior(study);
    let estimate = Iteration { state: batch.init(&prior), posterior: prior };
    Snapshot { figures: Figures::default(), estimate, states: vec![None; study.records.len()] }
}

/// Runs the whole ensemble; a failed particle is left to the estimator, which can do without it.
fn run_ensemble(
    runner: &mut EnsembleRunner<'_>,
    now: &mut Snapshot<Iteration>,
    at: AnalysisIndex,
    theta: &DMatrix<f64>,
    windows: &StepWindows,
) -> Result<Results, RunError> {
    let before = runner.counts;
    let results = runner.run_from_start(at, theta, windows)?;
    now.figures.counts.add_since(before, runner.counts);
    now.figures.failures = runner.learned();
    Ok(results)
}

fn advance(figures: &mut Figures, step: &BatchStep) {
    figures.step += 1;
    // Before the first ensemble that could be linearised the figures are infinite, which a snapshot cannot hold.
    if step.n_used > 0 {
        figures.nis = step.misfit;
        figures.n_used = step.n_used;
        figures.log_likelihood = step.evidence;
    }
}

fn row(study: &Study, at: AnalysisIndex, step: &BatchStep) -> AnalysisRow {
    AnalysisRow {
        pass: at.pass,
        step: at.step,
        time: (at.step + 1) as f64,
        n_used: step.n_used,
        nis: step.misfit,
        log_likelihood: step.log_likelihood,
        information_lost: 0.0,
        estimates: posterior::rows(study, &step.posterior),
        innovations: Vec::new(),
        jobs: Vec::new(),
    }
}

fn finish(now: Snapshot<Iteration>, plan: WorkPlan) -> Fit {
    let done = plan::done(&plan.at(0, now.figures.step, More::Expected(0)));
    Fit {
        converged: now.estimate.state.converged,
        posterior: now.estimate.posterior,
        starts: Vec::new(),
        log_likelihood: now.figures.log_likelihood,
        nis: now.figures.nis,
        n_used: now.figures.n_used,
        information_lost: 0.0,
        dropped: 0.0,
        counts: now.figures.counts,
        passes: 1,
        last_move: None,
        work: (plan, done),
    }
}

fn progress(
    now: &Snapshot<Iteration>,
    (batch, plan): (&Batch, &WorkPlan),
    more: More,
    runner: &EnsembleRunner<'_>,
) -> Progress {
    Progress {
        stage: "batch",
        pass: 1,
        passes: Some(1),
        step: now.figures.step,
        steps: batch.max_iterations,
        runs: now.figures.counts.total,
        workers: runner.n_workers(),
        work: plan.at(0, now.figures.step, more),
    }
}
