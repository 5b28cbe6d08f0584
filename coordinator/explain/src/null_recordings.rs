//! The measured false-alarm rate of a study: the whole search on simulated recordings in which no effect is missing.
//!
//! Each recording is the fitted model as it is plus noise of the stated sd, correlated where that of the measured one is, with its
//! gaps and spans. Runs that the search has made already are not made again, since a run does not depend on the measured values.
//! Next file to read: [`crate::diagnosis`].

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::quantiles::wilson;
use starlings_fleet::Fleet;
use starlings_study::store::Store;
use starlings_study::{Stage, Study};

use crate::diagnosis::diagnose;
use crate::error::ExplainError;
use crate::judge::verdict::Verdict;
use crate::options::{Context, Options};
use crate::rows::Rows;
use crate::run_cache::{Foreseen, RunCache};
use crate::tell::result::Nulls;

/// Searches `options.nulls` simulated recordings. `fitted` is what the fitted model as it is predicts, by row, and the rows with their
/// noise; `foreseen` what of the work is done.
///
/// # Errors
/// When the fleet or the store fails. A simulated recording whose fit does not converge counts as one without a name.
pub(super) fn measure(
    study: &Study,
    (fitted, foreseen): (&(Arc<Vec<f64>>, Rows), &Foreseen),
    fleet: &mut dyn Fleet,
    store: &Store,
    context: &mut Context<'_>,
    options: &Options,
) -> Result<Nulls, ExplainError> {
    let mut nulls = Nulls { of: options.nulls, ..Nulls::default() };
    let options = Options { force: true, ..options.clone() };
    for k in 0..nulls.of {
        let simulated = simulated(study, fitted, &mut random(study.seed, k as u64));
        let says = format!("{} of {} recordings without a gap", k + 1, nulls.of);
        let (work, runs) = (foreseen.null(k, nulls.runs), nulls.runs);
        (context.watch)(&Stage { name: "null", says, runs, workers: fleet.n_workers(), work });
        let mut quiet = |_: &Stage| {};
        let mut inner = Context {
            clock: context.clock,
            watch: &mut quiet,
            events: context.events,
            earlier_s: context.earlier_s,
        };
        let mut cache = RunCache::new(&simulated, &mut *fleet, store, &mut inner, None);
        cache.hold_at_most(options.hold);
        let verdict = diagnose(&mut cache, &simulated, &options, |_, answer| Ok(answer.decision.verdict));
        nulls.runs += cache.runs();
        match verdict {
            Ok(Verdict::Named | Verdict::Tie) => nulls.names += 1,
            Ok(_) | Err(ExplainError::NotConverged { .. } | ExplainError::Baseline(_)) => {}
            Err(error) => return Err(error),
        }
    }
    let [_, upper95] = wilson(nulls.names as f64 / nulls.of.max(1) as f64, nulls.of as f64);
    nulls.upper95 = upper95;
    Ok(nulls)
}

/// The random numbers of recording `k`: the seed of the study is the key of the generator and the recording a stream of it, so
/// that no two studies and no two recordings share one (Bernstein 2008: key and stream are different words of the ChaCha
/// block). Stream 0 is the search's own.
fn random(seed: u64, k: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(k + 1);
    random
}

/// The study with its measured values replaced by predictions and noise.
fn simulated(study: &Study, (predicted, rows): &(Arc<Vec<f64>>, Rows), random: &mut ChaCha8Rng) -> Study {
    let mut simulated = study.clone();
    let records = Arc::make_mut(&mut simulated.records);
    let mut noise: Vec<f64> = rows.rows.iter().map(|_| StandardNormal.sample(random)).collect();
    rows.colour(0, &mut noise);
    for ((row, y), noise) in rows.rows.iter().zip(&**predicted).zip(noise) {
        records[row.record].channels[row.channel].values[row.step] = y + row.noise * noise;
    }
    simulated
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use rand::Rng;

    use super::*;

    #[test]
    fn recordings_of_neighbouring_study_seeds_share_no_stream_with_each_other_nor_with_the_search() {
        let mut first: HashMap<u64, (u64, u64)> = HashMap::new();
        for seed in 0..40 {
            for k in 0..40 {
                let number = random(seed, k).next_u64();
                assert_eq!(first.insert(number, (seed, k)), None, "seed {seed}, recording {k}");
            }
            let of_search = ChaCha8Rng::seed_from_u64(seed).next_u64();
            assert_eq!(first.insert(of_search, (seed, u64::MAX)), None, "the search with seed {seed}");
        }
        assert_eq!(first.len(), 40 * 41);
        assert_eq!(random(3, 7).next_u64(), random(3, 7).next_u64(), "the same recording has the same noise");
    }
}
