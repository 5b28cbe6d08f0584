//! How many runs a diagnosis makes, as far as that can be foreseen: for whoever waits; nothing that is found depends on it.
//!
//! Next file to read: [`super::runs`].

use starlings_study::diagnosis::Diagnosis;
use starlings_study::{Study, Work};

use crate::search::REFINED;

/// Iterations that are expected of a fit.
const ITERATIONS: f64 = 5.0;

/// Runs of every part in their order: the model without a fault, the grid of every scenario, the fits of all of them.
#[derive(Clone, Debug)]
pub(crate) struct Foreseen {
    parts: Vec<f64>,
    part: usize,
    /// Runs at the beginning of the part.
    before: f64,
}

impl Foreseen {
    pub(crate) fn new(of: &Diagnosis) -> Self {
        let records =
            |study: &Study| study.records.iter().filter(|record| record.is_trained()).count() as f64;
        // The residuals, and a Jacobian.
        let fit = |study: &Study| ITERATIONS * records(study) * (study.theta.len() as f64 + 2.0);
        let grids = of.scenarios.iter().map(|s| match s.n_start() {
            1 => 0.0,
            n => n as f64 * records(&s.study),
        });
        let fits = of.scenarios.iter().map(|s| s.n_start().min(REFINED) as f64 * fit(&s.study));
        let parts = std::iter::once(fit(&of.healthy)).chain(grids).chain([fits.sum()]).collect();
        Self { parts, part: 0, before: 0.0 }
    }

    /// A part begins after so many runs.
    pub(crate) fn begin(&mut self, part: usize, runs: u64) {
        (self.part, self.before) = (part, runs as f64);
    }

    /// The work after so many runs, with as many `next`.
    pub(crate) fn work(&self, runs: u64, next: usize) -> Work {
        let (done, next) = (runs as f64, next as f64);
        let of = |part: usize| self.parts.get(part).copied().unwrap_or(0.0);
        let later: f64 = (self.part + 1..self.parts.len()).map(of).sum();
        Work::of_runs(done, next, (self.before + of(self.part)).max(done + next) + later)
    }
}
