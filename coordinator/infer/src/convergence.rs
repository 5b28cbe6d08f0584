//! The estimate after each power of two of blocks: how it converges as the recording goes on.
//!
//! Sums are kept on the way and fitted at the end, all in the same way: a curve is of one estimator. An estimate that cannot be made of
//! so few steps is left out. Next file to read: `answer.rs`.

use starlings_estimators::inference::{Estimate, Fit, Posterior, Structure, Sums};

use crate::gather::Gathered;
use crate::result::Converging;

/// Sums on the way, with the number of their blocks.
#[derive(Default)]
pub(crate) struct Convergence {
    kept: Vec<(u64, Sums)>,
}

impl Convergence {
    /// Keeps what there is when the number of blocks is a power of two.
    pub(crate) fn look(&mut self, gathered: &Gathered) {
        let sums = gathered.levels.first().filter(|_| gathered.n_block.is_power_of_two());
        self.kept.extend(sums.map(|sums| (gathered.n_block, sums.clone())));
    }

    /// The estimates by one fit, the last of them that of all blocks.
    pub(crate) fn finish(mut self, fit: &Fit, structure: &Structure, gathered: &Gathered) -> Vec<Converging> {
        self.kept.retain(|(n_block, _)| *n_block < gathered.n_block);
        self.kept.extend(gathered.levels.first().map(|sums| (gathered.n_block, sums.clone())));
        let found = |(n_block, sums): &(u64, Sums)| {
            let posterior = fit.posterior(sums, structure).ok()?;
            Some(at(*n_block, sums, &posterior))
        };
        self.kept.iter().filter_map(found).collect()
    }
}

fn at(n_block: u64, sums: &Sums, posterior: &Posterior) -> Converging {
    let value = |e: &Estimate| e.value.map(|v| [v.mean, v.sd]);
    Converging {
        n_block,
        n_step: sums.n_step(),
        time: sums.n_step() as f64 * sums.step(),
        values: posterior.estimates.iter().map(value).collect(),
        diffusion: posterior.diffusion.diagonal().iter().copied().collect(),
    }
}
