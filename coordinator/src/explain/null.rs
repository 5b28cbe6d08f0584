//! The false-alarm rate of a study, measured: the whole search on recordings in which nothing is missing.
//!
//! Each recording is the fitted model as it is plus noise of the stated sd, with the gaps and spans of the measured one. Runs
//! that the search has made already cost nothing, since what they depend on is not the data. Next file to read: [`super::run`].

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::laboratory::Laboratory;
use super::result::Nulls;
use super::rows::Rows;
use super::run::answered;
use super::{Context, ExplainError, Options, Stage, Verdict, answer};
use crate::fleet::Fleet;
use crate::study::Study;
use crate::study::store::Store;

/// Searches `options.nulls` simulated recordings. `predicted` is what the fitted model as it is predicts, by row.
///
/// # Errors
/// When the fleet or the store fails. A simulated recording whose fit does not converge counts as one without a name.
pub(super) fn measure(
    study: &Study,
    predicted: &[f64],
    fleet: &mut dyn Fleet,
    store: &Store,
    context: &mut Context<'_>,
    options: &Options,
) -> Result<Nulls, ExplainError> {
    let mut nulls = Nulls { of: options.nulls, ..Nulls::default() };
    let options = Options { force: true, ..options.clone() };
    for k in 0..nulls.of {
        let simulated = simulated(study, predicted, study.seed.wrapping_add(1 + k as u64));
        let (runs, n_worker) = (nulls.runs, fleet.n_workers());
        let says = format!("{} of {} recordings without a gap", k + 1, nulls.of);
        (context.watch)(&Stage { name: "null", says, runs, workers: n_worker });
        let mut quiet = |_: &Stage| {};
        let mut inner = Context {
            clock: context.clock,
            watch: &mut quiet,
            events: context.events,
            earlier_s: context.earlier_s,
        };
        let mut laboratory = Laboratory::new(&simulated, &mut *fleet, store, &mut inner, None);
        let verdict =
            answered(&mut laboratory, &simulated, &options, |_, answer| Ok(answer.decision.verdict));
        nulls.runs += laboratory.runs();
        match verdict {
            Ok(Verdict::Named | Verdict::Tie) => nulls.names += 1,
            Ok(_) | Err(ExplainError::NotConverged { .. } | ExplainError::Baseline(_)) => {}
            Err(error) => return Err(error),
        }
    }
    nulls.upper95 = answer::wilson_upper(nulls.names as f64 / nulls.of.max(1) as f64, nulls.of as f64);
    Ok(nulls)
}

/// The study with its measured values replaced by predictions and noise.
fn simulated(study: &Study, predicted: &[f64], seed: u64) -> Study {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut simulated = study.clone();
    let records = Arc::make_mut(&mut simulated.records);
    for (row, y) in Rows::new(study).rows.iter().zip(predicted) {
        let noise: f64 = StandardNormal.sample(&mut random);
        records[row.record].channels[row.channel].values[row.step] = y + row.noise * noise;
    }
    simulated
}
