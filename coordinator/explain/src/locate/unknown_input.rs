//! The input that an equation would need: a random walk added to the rate of one state, estimated from the data.
//!
//! All parameters stay where they are. The walk and the states it moves are followed by a reduced-order unscented filter whose
//! particles span the leading directions of their joint covariance, and then smoothed backwards through the same coordinates,
//! so that the estimate at a time knows the data after it. It shows where and when something is missing, but not what: every
//! cause in that equation gives the same input. A model that cannot restart has no estimate. Next files to read: [`candidate`]
//! for which equations are tried, [`walk`] for the filter.
//!
//! The longest trained record is followed, and the two equations whose input its channels feel most. Cost per equation, in
//! runs of that record: 2 to find how strongly the data feel the input, all that an equation costs which is not followed; then
//! 1 for the state at the start, and 3 walks of up to 5 particles.

mod candidate;
mod walk;

use std::sync::Arc;

use starlings_fleet::Fleet;
use starlings_models::{ObserverDef, Spec};
use starlings_study::Study;

use self::candidate::{Candidate, candidates};
use self::walk::{DIRECTIONS, Estimate, Walk};
use super::UnknownInput;
use crate::error::ExplainError;

/// Windows of the record at most: neighbouring ones are joined.
const WINDOWS: usize = 200;
/// Equations at most.
const MOST: usize = 2;
/// Runs of all walks at most, a simplex of particles for each and one for the start; those that find the equations are 2 per
/// scalar state.
pub const MOST_RUNS: usize = MOST * (INTENSITIES.len() * (DIRECTIONS + 1) + 1);
/// Growth of the walk's sd over a record, in units of the constant input that would move the outputs as far as the residuals.
const INTENSITIES: [f64; 3] = [0.5, 4.0, 30.0];

/// The unknown inputs of every scalar state that the data feel, strongest gain first. `theta` is the estimated vector in
/// transformed units; runs are counted in `runs` as whole records.
///
/// # Errors
/// When the fleet fails as a whole, a run is lost with its workers, or a setup does not build. An equation with which the model
/// fails is left out.
pub fn unknown_inputs(
    study: &Study,
    fleet: &mut dyn Fleet,
    theta: &[f64],
    runs: &mut u64,
) -> Result<Vec<UnknownInput>, ExplainError> {
    if !study.spec.restart {
        return Ok(Vec::new());
    }
    let thinned = thinned(study);
    let Some(record) = longest(&thinned) else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    let states = &thinned.spec.states;
    let scalars: Vec<(&str, usize)> = states
        .iter()
        .filter(|q| q.size == 1)
        .filter_map(|q| Some((q.name.as_str(), Spec::offset(states, &q.name)?)))
        .collect();
    for candidate in candidates(&thinned, fleet, theta, record, runs)?.iter().take(MOST) {
        let theta = thinned.theta_for(record, theta);
        let at = scalars.iter().map(|(_, at)| *at).collect();
        let walk = Walk { study: &thinned, candidate, record, theta, scalars: at };
        let estimates = walk.estimate(fleet, &INTENSITIES, runs)?.into_iter().flatten();
        let best = estimates.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
        found.extend(best.map(|best| input(&thinned, (candidate, record), &scalars, best)));
    }
    found.sort_by(|a: &UnknownInput, b| b.log_likelihood_gain.total_cmp(&a.log_likelihood_gain));
    Ok(found)
}

fn input(
    study: &Study,
    (candidate, record): (&Candidate, usize),
    scalars: &[(&str, usize)],
    best: Estimate,
) -> UnknownInput {
    let per = if study.time_unit.is_empty() { "time" } else { study.time_unit.as_str() };
    let state = if candidate.unit.is_empty() { "1" } else { candidate.unit.as_str() };
    let of_scalars = scalars.iter().zip(best.states);
    let states: Vec<(String, Vec<f64>)> =
        of_scalars.map(|((n, _), course)| ((*n).to_owned(), course)).collect();
    let own = states.iter().find(|(name, _)| *name == candidate.state);
    UnknownInput {
        state: candidate.state.clone(),
        unit: if state.contains('/') { format!("({state})/{per}") } else { format!("{state}/{per}") },
        record: study.records[record].name.clone(),
        time: best.time,
        value: best.value,
        sd: best.sd,
        at: own.map_or_else(Vec::new, |(_, course)| course.clone()),
        states,
        log_likelihood_gain: best.log_likelihood - best.without,
        proposed: Vec::new(),
    }
}

/// The study with windows joined until a record has no more than [`WINDOWS`], and its observer off.
fn thinned(study: &Study) -> Study {
    let mut thinned = study.clone();
    for record in Arc::make_mut(&mut thinned.records) {
        let rows =
            record.times.iter().filter(|t| record.train.is_some_and(|[from, to]| from <= **t && **t <= to));
        record.every = record.every.max(rows.count().div_ceil(WINDOWS));
    }
    thinned.setup.observer = ObserverDef { kind: "none".to_owned(), ..ObserverDef::default() };
    thinned
}

/// The record with the longest training span, the first of equals.
fn longest(study: &Study) -> Option<usize> {
    let span = |r: &usize| study.records[*r].train_span().map_or(0.0, |[from, to]| to - from);
    let records = (0..study.records.len()).filter(|r| study.windows(*r).len() > 4);
    records.min_by(|a, b| span(b).total_cmp(&span(a)))
}
