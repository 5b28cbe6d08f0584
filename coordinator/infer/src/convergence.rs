//! The estimate after each power of two of blocks: how it converges as the recording goes on.
//!
//! An estimate that cannot be made of so few steps is left out. Next file to read: `answer.rs`.

use starlings_estimators::inference::{Fit, Posterior, Structure, Sums};

use crate::gather::Gathered;
use crate::result::Converging;

/// Estimates on the way.
pub(crate) struct Convergence<'a> {
    fit: &'a Fit,
    structure: &'a Structure,
    earlier: Option<Posterior>,
    pub(crate) found: Vec<Converging>,
}

impl<'a> Convergence<'a> {
    pub(crate) fn new(fit: &'a Fit, structure: &'a Structure) -> Self {
        Self { fit, structure, earlier: None, found: Vec::new() }
    }

    /// Looks at what there is; estimates when the number of blocks is a power of two.
    pub(crate) fn look(&mut self, gathered: &Gathered) {
        let Some(sums) = gathered.levels.first().filter(|_| gathered.n_block.is_power_of_two()) else {
            return;
        };
        let found = match &self.earlier {
            Some(earlier) => self.fit.update(sums, self.structure, earlier),
            None => self.fit.posterior(sums, self.structure),
        };
        if let Ok(posterior) = found {
            self.found.push(at(gathered.n_block, sums, &posterior));
            self.earlier = Some(posterior);
        }
    }

    /// The estimates, the last of all blocks at their end.
    pub(crate) fn finish(mut self, n_block: u64, sums: &Sums, posterior: &Posterior) -> Vec<Converging> {
        self.found.retain(|found| found.n_block != n_block);
        self.found.push(at(n_block, sums, posterior));
        self.found
    }
}

fn at(n_block: u64, sums: &Sums, posterior: &Posterior) -> Converging {
    let value = |e: &starlings_estimators::inference::Estimate| e.value.map(|v| [v.mean, v.sd]);
    Converging {
        n_block,
        n_step: sums.n_step(),
        time: sums.n_step() as f64 * sums.step(),
        values: posterior.estimates.iter().map(value).collect(),
        diffusion: posterior.diffusion.diagonal().iter().copied().collect(),
    }
}
