//! Resampling for sigma sets with more points than an affine map needs: keep the leading directions of the whole spread.
//!
//! Only the r × r Gram matrix of the particles reaches the estimator. Predictions at a window's end are taken again at the
//! redrawn points by runs of zero length; the earlier ones of its times, and all of them where an observer has already
//! corrected the state by the datum, are mixed as the states are. Source: Moireau & Chapelle (2011), Verdandi's treatment of
//! the canonical and star sets.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{Filter, Particles, Resampled};
use starlings_fleet::StateError;
use starlings_models::{Quantity, Window};

use super::ensemble::recombine;
use super::runner::{AnalysisIndex, EnsembleRunner, StepWindows};
use super::stack::stack_outputs;
use crate::expand::INITIAL;
use crate::states::States;
use crate::{RunError, Study};

/// Weight of an initial value while its record runs, beside the states that follow from it.
const INITIAL_WEIGHT: f64 = 1e-3;

/// Gram matrix (r × r) of the √α-weighted deviations of the augmented particles.
///
/// Rows are made commensurable: each state quantity by its size in the ensemble mean, each parameter by its prior sd. Initial
/// values act through the states while their record runs, so they have a small weight then; with none, an initial value that no
/// longer shows in its state would be mixed at random.
///
/// States are gone through twice, a block of rows at a time, whether they are in memory or in the store.
fn gram(
    study: &Study,
    weights: &DVector<f64>,
    particles: &Particles,
    states: &[Option<States>],
) -> Result<DMatrix<f64>, StateError> {
    let mut gram = DMatrix::zeros(weights.len(), weights.len());
    for x in states.iter().flatten() {
        let mut squares = vec![0.0; study.spec.states.len()];
        x.for_each_block(|first, rows| {
            for (index, part) in parts(study, first, rows.nrows()) {
                squares[index] += (rows.rows(part.start, part.len()) * weights).norm_squared();
            }
        })?;
        let size = |(quantity, sum): (&Quantity, f64)| (sum / quantity.size as f64).sqrt();
        let sizes: Vec<f64> = study.spec.states.iter().zip(squares).map(size).collect();
        x.for_each_block(|first, rows| {
            for (index, part) in parts(study, first, rows.nrows()) {
                let scale = if sizes[index] > 0.0 { sizes[index] } else { 1.0 };
                add(&mut gram, &rows.rows(part.start, part.len()).into_owned(), weights, scale);
            }
        })?;
    }
    for (j, entry) in study.theta.iter().enumerate() {
        let initial = study.parameters[entry.parameter].name.starts_with(INITIAL);
        let running = entry.record.map_or(states.iter().any(Option::is_some), |r| states[r].is_some());
        let share = if initial && running { INITIAL_WEIGHT } else { 1.0 };
        add(&mut gram, &particles.theta.rows(j, 1).into_owned(), weights, entry.prior_sd / share);
    }
    Ok(gram)
}

/// Which rows of a block belong to which quantity, where the block's first row is number `first`.
fn parts(study: &Study, first: usize, rows: usize) -> Vec<(usize, Range<usize>)> {
    let mut end = 0;
    let part = |(index, quantity): (usize, &Quantity)| {
        let start = end;
        end += quantity.size;
        let within = |row: usize| row.clamp(first, first + rows) - first;
        let part = within(start)..within(end);
        (!part.is_empty()).then_some((index, part))
    };
    study.spec.states.iter().enumerate().filter_map(part).collect()
}

fn add(gram: &mut DMatrix<f64>, rows: &DMatrix<f64>, weights: &DVector<f64>, scale: f64) {
    let mean = rows * weights;
    let mut deviation = rows.clone();
    for (mut column, weight) in deviation.column_iter_mut().zip(weights.iter()) {
        column -= &mean;
        column *= weight.sqrt() / scale;
    }
    gram.gemm_tr(1.0, &deviation, &deviation, 1.0);
}

/// An ensemble after resampling.
pub(crate) struct Redrawn {
    /// The redrawn particles.
    pub(crate) particles: Particles,
    /// Their predictions, m × r.
    pub(crate) predictions: DMatrix<f64>,
    /// The r × r matrix R of X ← X R.
    pub(crate) transform: DMatrix<f64>,
    /// Share of the spread, in the norm of the Gram matrix, that they leave out.
    pub(crate) dropped: f64,
}

/// Redraws particles and states around the leading directions and observes them again: the new
/// ensemble. `None`, and nothing changed, when a redrawn particle cannot be observed.
///
/// # Errors
/// When the fleet or the estimator fails.
pub(crate) fn redraw(
    runner: &mut EnsembleRunner<'_>,
    filter: &dyn Filter,
    at: AnalysisIndex,
    windows: &StepWindows,
    particles: &Particles,
    predictions: &DMatrix<f64>,
    states: &mut Vec<Option<States>>,
) -> Result<Option<Redrawn>, RunError> {
    let study = runner.study();
    let Resampled { particles: redrawn, transform, dropped } =
        filter.resample(particles, &gram(study, filter.weights(), particles, states)?)?;
    let mut mixed = states.clone();
    recombine(&mut mixed, &transform, runner)?;
    let mut observed = predictions * &transform;
    // Where an observer has corrected the state by the datum, an output of that state is no prediction of it.
    if study.observer_is_off() && !observe_again(runner, at, &redrawn.theta, &mixed, windows, &mut observed)?
    {
        return Ok(None);
    }
    *states = mixed;
    Ok(Some(Redrawn { particles: redrawn, predictions: observed, transform, dropped }))
}

/// Puts the outputs at the windows' ends, by runs of zero length, into the predictions; `false` when a run fails.
fn observe_again(
    runner: &mut EnsembleRunner<'_>,
    at: AnalysisIndex,
    theta: &DMatrix<f64>,
    states: &[Option<States>],
    windows: &StepWindows,
    predictions: &mut DMatrix<f64>,
) -> Result<bool, RunError> {
    let instants: StepWindows = windows.iter().map(|(record, w)| (*record, Arc::new(instant(w)))).collect();
    let everyone: Vec<usize> = (0..theta.ncols()).collect();
    let results = runner.run(at, &everyone, theta, states, &instants)?;
    if results.iter().flatten().any(Result::is_err) {
        return Ok(false);
    }
    let ends = stack_outputs(&results, &instants);
    let n_obs = runner.study().setup.outputs.len();
    let mut after = 0;
    for (index, (_, window)) in windows.iter().enumerate() {
        after += window.observed.len();
        predictions.rows_mut(after - n_obs, n_obs).copy_from(&ends.rows(index * n_obs, n_obs));
    }
    Ok(true)
}

/// The last instant of a window, as a window of its own.
fn instant(window: &Window) -> Window {
    let end = window.times.last().copied().unwrap_or(window.start);
    let n_obs = window.observed.len() / window.times.len().max(1);
    Window::free(end, vec![end], n_obs, window.inputs.clone())
}
