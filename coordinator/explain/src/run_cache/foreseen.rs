//! How many points an explanation still runs, as far as that can be foreseen: for whoever waits; nothing that is found depends on it.
//!
//! What a fit takes is learned from the fits so far, what a screening takes from the candidates. Next file to read: [`super::batches`].

use starlings_study::{Study, Work};

/// Iterations that are expected of the fit of the model as it is.
const ITERATIONS: f64 = 5.0;
/// Candidates, and points of their grids, that are expected before they are known.
const CANDIDATES: f64 = 40.0;
const GRID: f64 = 2.0;
/// Points of a screening that are run once more with another amplitude, as a share.
const AGAIN: f64 = 0.3;
/// Fits that are driven at a time after a screening, and the iterations of each.
const REFITS: f64 = 6.0;
const OF_REFIT: f64 = 4.0;
/// Forms of what was named that are tried beside the candidates.
const FORMS: f64 = 10.0;

/// Runs of the search of a recording without a gap, as a share of those of the measured one: nothing is refitted.
const OF_NULL: f64 = 0.5;

/// A part of an explanation, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    /// The fit of the model as it is.
    Fit,
    /// The first screening.
    Screen,
    /// The refits of the best candidates.
    Refit,
    /// What is screened and refitted beside the best.
    Second,
    /// What is left: the verdict, the figures.
    Rest,
}

/// What is foreseen, in runs.
#[derive(Clone, Debug)]
pub(crate) struct Foreseen {
    part: Part,
    /// Runs at the beginning of the part.
    before: f64,
    /// Runs of one point: the records.
    records: f64,
    /// Entries that a Jacobian moves.
    moved: f64,
    /// Candidates and points of their grids.
    candidates: [f64; 2],
    /// Simulated recordings that are searched afterwards.
    nulls: f64,
}

impl Foreseen {
    pub(super) fn new(study: &Study) -> Self {
        Self {
            part: Part::Fit,
            before: 0.0,
            records: study.records.len() as f64,
            moved: study.parameters.len() as f64,
            candidates: [CANDIDATES, GRID * CANDIDATES],
            nulls: 0.0,
        }
    }

    /// A stage of this name begins after so many runs: a fit begins all anew, in units of another noise.
    pub(super) fn stage(&mut self, name: &str, runs: u64) {
        let part = match name {
            "fit" => Part::Fit,
            "screen" if self.part < Part::Screen => Part::Screen,
            "refit" if self.part < Part::Refit => Part::Refit,
            // Terms of further kinds are tried after a verdict.
            "screen" if matches!(self.part, Part::Refit | Part::Rest) => Part::Second,
            "verdict" | "add" | "show" => Part::Rest,
            _ => return,
        };
        if part != self.part || part == Part::Fit {
            (self.part, self.before) = (part, runs as f64);
        }
    }

    /// What is known of the candidates: how many, and how many points their grids have.
    pub(crate) fn candidates(&mut self, n: usize, n_point: usize) {
        self.candidates = [n as f64, n_point as f64];
    }

    /// So many simulated recordings are searched afterwards.
    pub(crate) fn nulls(&mut self, n: usize) {
        self.nulls = n as f64;
    }

    /// Runs that the search of a simulated recording takes, by those of the measured one.
    pub(crate) fn of_null(runs: f64) -> f64 {
        OF_NULL * runs
    }

    /// The work after so many runs, with as many `next`.
    pub(super) fn work(&self, runs: u64, next: usize) -> Work {
        let done = runs as f64;
        let here = (self.before + self.runs_of(self.part)).max(done + next as f64);
        let later: f64 = [Part::Fit, Part::Screen, Part::Refit, Part::Second, Part::Rest]
            .into_iter()
            .filter(|p| *p > self.part)
            .map(|p| self.runs_of(p))
            .sum();
        let search = here + later;
        Work { done, next: next as f64, total: search + self.nulls * Self::of_null(search) }
    }

    /// Runs of a part.
    fn runs_of(&self, part: Part) -> f64 {
        let [n, n_point] = self.candidates;
        let iteration = self.moved + 3.0;
        self.records
            * match part {
                Part::Fit => ITERATIONS * iteration,
                Part::Screen => n_point * (1.0 + AGAIN),
                Part::Refit => REFITS * OF_REFIT * iteration,
                Part::Second => n * (1.0 + AGAIN) + FORMS + 0.5 * REFITS * OF_REFIT * iteration,
                Part::Rest => 4.0,
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn foreseen() -> Foreseen {
        let candidates = [30.0, 50.0];
        Foreseen { part: Part::Fit, before: 0.0, records: 2.0, moved: 3.0, candidates, nulls: 0.0 }
    }

    #[test]
    fn what_takes_longer_than_expected_moves_the_end_and_what_is_short_brings_it_nearer() {
        let mut of = foreseen();
        let first = of.work(0, 8).total;
        assert!((of.work(10, 8).total - first).abs() < 1e-9, "as expected");
        assert!((of.work(1000, 8).total - (1008.0 + first - 60.0)).abs() < 1e-9, "a fit of many iterations");
        of.stage("screen", 20);
        assert!((of.work(20, 0).total - (first - 40.0)).abs() < 1e-9, "a fit of two iterations");
        // No gap: what would be refitted is not.
        of.stage("verdict", 150);
        assert!(of.work(150, 0).total < 160.0);
        // Nothing explains it, and terms of another kind are tried.
        of.stage("screen", 155);
        assert!(of.work(155, 0).total > 200.0);
    }

    #[test]
    fn a_search_in_units_of_another_noise_is_all_of_it_again() {
        let mut of = foreseen();
        let first = of.work(0, 0).total;
        of.stage("screen", 70);
        of.stage("refit", 200);
        of.stage("screen", 500);
        of.stage("verdict", 700);
        of.stage("fit", 702);
        assert!((of.work(702, 0).total - (702.0 + first)).abs() < 1e-9);
    }
}
