//! The input that an equation would need: a random walk added to the rate of one state, estimated from the data.
//!
//! All parameters stay where they are. The walk and the states it moves are followed by a reduced-order unscented filter
//! whose particles span the leading directions of their joint covariance, and then smoothed backwards through the same
//! coordinates, so that the estimate at a time knows the data after it. It says where and when something is missing, not
//! what: any cause in that equation looks the same. A model that cannot restart has none. Next files to read:
//! [`candidate`] for which equations are tried, [`walk`] for the filter.
//!
//! Cost per equation, in runs of one record: 2 to find how strongly the data feel the input, then 3 walks of up to 5
//! particles over the longest trained record, and the best of them over the second longest. Equations whose input no
//! channel feels cost the first 2 only.

mod candidate;
mod walk;

use starlings_models::ObserverDef;

use self::candidate::{Candidate, candidates};
use self::walk::{Estimate, Walk};
use super::correlate::{interval, pearson};
use super::number::three;
use super::{Correlated, UnknownInput};
use crate::explain::ExplainError;
use crate::fleet::Fleet;
use crate::study::Study;

/// Windows per record at most: neighbouring ones are joined.
const WINDOWS: usize = 200;
/// Equations at most.
const MOST: usize = 2;
/// Runs of all walks at most; those that find the equations are 2 per scalar state.
pub const MOST_RUNS: usize = MOST * INTENSITIES.len() * 5;
/// Records at most.
const RECORDS: usize = 1;
/// Growth of the walk's sd over a record, in units of the constant input that would move the outputs as far as the residuals.
const INTENSITIES: [f64; 3] = [0.5, 4.0, 30.0];

/// The unknown inputs of every scalar state that the data feel, strongest gain first. `theta` is the estimated vector in
/// transformed units; runs are counted in `runs` as whole records.
///
/// # Errors
/// When the fleet fails as a whole, or a setup does not build. An equation whose runs fail is left out.
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
    let records = longest(&thinned);
    let Some(&first) = records.first() else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for candidate in candidates(&thinned, fleet, theta, first, runs)?.into_iter().take(MOST) {
        found.extend(of_equation(&thinned, fleet, theta, &candidate, &records, runs)?);
    }
    let gain = |input: &UnknownInput| input.log_likelihood_gain;
    found.sort_by(|a: &Vec<UnknownInput>, b| gain(&b[0]).total_cmp(&gain(&a[0])));
    Ok(found.into_iter().flatten().collect())
}

/// The walks of one equation: the best intensity on the first record, then that one on the others. `None` when all fail.
fn of_equation(
    study: &Study,
    fleet: &mut dyn Fleet,
    theta: &[f64],
    candidate: &Candidate,
    records: &[usize],
    runs: &mut u64,
) -> Result<Option<Vec<UnknownInput>>, ExplainError> {
    let mut inputs = Vec::new();
    let mut intensities = INTENSITIES.to_vec();
    for &record in records {
        let walk = Walk { study, candidate, record, theta: study.theta_for(record, theta) };
        let estimates = walk.estimate(fleet, &intensities, runs)?;
        let best =
            estimates.into_iter().flatten().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
        let Some(best) = best else { break };
        intensities = vec![best.intensity];
        inputs.push(input(study, candidate, record, best));
    }
    Ok((!inputs.is_empty()).then_some(inputs))
}

fn input(study: &Study, candidate: &Candidate, record: usize, best: Estimate) -> UnknownInput {
    let per = if study.time_unit.is_empty() { "time" } else { study.time_unit.as_str() };
    let state = if candidate.unit.is_empty() { "1" } else { candidate.unit.as_str() };
    UnknownInput {
        state: candidate.state.clone(),
        unit: if state.contains('/') { format!("({state})/{per}") } else { format!("{state}/{per}") },
        record: study.records[record].name.clone(),
        time: best.time,
        value: best.value,
        sd: best.sd,
        at: best.at,
        log_likelihood_gain: best.log_likelihood - best.without,
    }
}

/// A function of a state.
type Shape = fn(f64) -> f64;

/// What an unknown input goes along with: the state of its equation, its sign, square and product with its size, strongest
/// first. The intervals take every time as independent, which a smoothed walk is not: a description, not a test.
pub fn goes_along(input: &UnknownInput) -> Vec<Correlated> {
    let name = &input.state;
    let shapes: [(String, Shape); 4] = [
        (name.clone(), |x| x),
        (format!("sign of {name}"), |x| if x.abs() > 0.0 { x.signum() } else { 0.0 }),
        (format!("square of {name}"), |x| x * x),
        (format!("{name}·|{name}|"), |x| x * x.abs()),
    ];
    let mut found: Vec<Correlated> = shapes
        .into_iter()
        .filter_map(|(with, shape)| {
            let values: Vec<f64> = input.at.iter().map(|x| shape(*x)).collect();
            let (r, n) = pearson(&input.value, &values)?;
            let (coefficient, interval95) = interval(r, n as f64, 2.0)?;
            let channel = format!("unknown input of {name} ({} {})", three(rms(&input.value)), input.unit);
            Some(Correlated { channel, with, coefficient, interval95 })
        })
        .collect();
    found.sort_by(|a, b| b.coefficient.abs().total_cmp(&a.coefficient.abs()));
    found
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The study with windows joined until a record has no more than [`WINDOWS`], and its observer off.
fn thinned(study: &Study) -> Study {
    let mut thinned = study.clone();
    for record in &mut thinned.records {
        let rows =
            record.times.iter().filter(|t| record.train.is_some_and(|[from, to]| from <= **t && **t <= to));
        record.every = record.every.max(rows.count().div_ceil(WINDOWS));
    }
    thinned.setup.observer = ObserverDef { kind: "none".to_owned(), ..ObserverDef::default() };
    thinned
}

/// The trained records with most windows.
fn longest(study: &Study) -> Vec<usize> {
    let mut records: Vec<usize> = (0..study.records.len()).filter(|r| study.windows(*r).len() > 4).collect();
    let span = |r: &usize| study.records[*r].train_span().map_or(0.0, |[from, to]| to - from);
    records.sort_by(|a, b| span(b).total_cmp(&span(a)));
    records.truncate(RECORDS);
    records
}
