//! How much an explanation still does, as far as that can be foreseen: for whoever waits; nothing that is found depends on it.
//!
//! A search is open: what does not pass the gates is followed by pairs, by terms of other kinds, by all of it once more. Its end is told from
//! where something passed them on; what remains then is to score the candidates again, to refit what they add, and the verdict. Next file
//! to read: [`super::batches`].

use starlings_study::{Part, Study, Takes, Work};

use crate::locate::MOST_RUNS;

/// Iterations that are expected of the fit of the model as it is.
const ITERATIONS: f64 = 5.0;
/// Candidates, and points of their grids, that are expected before they are known.
const CANDIDATES: f64 = 40.0;
const GRID: f64 = 2.0;
/// Points of a screening that are run once more with another amplitude, as a share.
const AGAIN: f64 = 0.3;
/// Fits that are driven at a time after a screening, those that only begin to among them, and the iterations of each.
const REFITS: f64 = 4.0;
const OF_REFIT: f64 = 3.0;
/// Of two second passes one ends without fits.
const HALF: f64 = 0.5;

/// What a run over windows takes beside one of a whole record, until one was made: the inverse of what a run plans with.
const WINDOWED: f64 = 2.5;
/// What the verdict and the files take of the coordinator, s: by compared value, and of every explanation, as it took in that of the pig's
/// aorta in the development profile.
const VERDICT_VALUE_S: f64 = 4e-5;
const FILES_S: f64 = 0.1;

/// Runs of the search of a recording without a gap, as a share of those of the measured one: nothing is refitted.
const OF_NULL: f64 = 0.5;

/// Kinds of work, by their places.
const FIT: usize = 0;
const SCREEN: usize = 1;
const REFIT: usize = 2;
const OTHER: usize = 3;
const VERDICT: usize = 4;
const FILES: usize = 5;
const NULLS: usize = 6;

/// Where a search stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Course {
    /// The fit of the model as it is.
    Fit,
    /// The first screening.
    Screen,
    /// The race and the refits of the best candidates.
    Refit,
    /// So many candidates and forms are scored at the best of those that passed the gates.
    Again(usize),
    /// So many of them are refitted beside it or in its place.
    Beside(usize),
    /// So many are scored for the last time.
    Last(usize),
    /// Something else is tried, of which nobody knows how long it takes.
    Open,
    /// Nothing more is searched.
    Over,
}

/// What is foreseen.
#[derive(Clone, Debug)]
pub(crate) struct Foreseen {
    course: Course,
    /// Units that are done, by kinds of work, and those at the beginning of the course.
    done: [f64; 7],
    before: [f64; 7],
    /// The kind that is being done.
    at: usize,
    /// Runs of one point: the records.
    records: f64,
    /// Entries that a Jacobian moves.
    moved: f64,
    /// Candidates and points of their grids.
    candidates: [f64; 2],
    /// Values that are compared.
    values: f64,
    /// Simulated recordings that are searched afterwards.
    nulls: f64,
}

impl Foreseen {
    pub(super) fn new(study: &Study, values: usize) -> Self {
        Self {
            course: Course::Fit,
            done: [0.0; 7],
            before: [0.0; 7],
            at: FIT,
            records: study.records.len() as f64,
            moved: study.parameters.len() as f64,
            candidates: [CANDIDATES, GRID * CANDIDATES],
            values: values as f64,
            nulls: 0.0,
        }
    }

    /// A stage of this name begins. What the coordinator did alone until then is done.
    pub(super) fn stage(&mut self, name: &str) {
        if matches!(self.at, VERDICT | FILES) {
            self.done[self.at] += 1.0;
        }
        self.at = match name {
            "fit" => FIT,
            "screen" => SCREEN,
            "refit" | "gates" => REFIT,
            "verdict" => VERDICT,
            "show" => FILES,
            _ => OTHER,
        };
        match name {
            "fit" => self.goes(Course::Fit),
            "show" => self.goes(Course::Over),
            "verdict" => self.goes(match self.course {
                // Where nothing passed the gates something else may be tried after it.
                Course::Refit | Course::Open => Course::Open,
                _ => Course::Over,
            }),
            _ => {}
        }
    }

    /// The search takes this course from here.
    pub(crate) fn goes(&mut self, course: Course) {
        (self.course, self.before) = (course, self.done);
    }

    /// So many runs are counted.
    pub(super) fn count(&mut self, runs: u64) {
        self.done[self.at] += runs as f64;
    }

    /// What is known of the candidates: how many, and how many points their grids have.
    pub(crate) fn candidates(&mut self, n: usize, n_point: usize) {
        self.candidates = [n as f64, n_point as f64];
    }

    /// So many simulated recordings are searched afterwards.
    pub(crate) fn nulls(&mut self, n: usize) {
        self.nulls = n as f64;
    }

    /// The work now, with as many runs `next`, which are counted already.
    pub(super) fn work(&self, next: usize) -> Work {
        let next = next as f64;
        let mut done = self.done;
        done[self.at] = (done[self.at] - next).max(0.0);
        let here = self.of(self.course);
        let mut left = [0.0; 7];
        for kind in [FIT, SCREEN, REFIT] {
            left[kind] = (here[kind] - (done[kind] - self.before[kind])).max(0.0);
        }
        for (course, share) in self.later() {
            left.iter_mut().zip(self.of(course)).for_each(|(left, of)| *left += share * of);
        }
        left[OTHER] = (MOST_RUNS as f64 - done[OTHER]).max(0.0);
        for kind in [VERDICT, FILES] {
            left[kind] = if done[kind] > 0.0 { 0.0 } else { 1.0 };
        }
        if self.at == FILES {
            left = [0.0; 7];
            left[FILES] = 1.0;
        }
        left[self.at] = left[self.at].max(next);
        let search: f64 = done.iter().zip(&left).take(OTHER).map(|(done, left)| done + left).sum();
        left[NULLS] = self.nulls * OF_NULL * search;
        let is_open = matches!(self.course, Course::Fit | Course::Screen | Course::Refit | Course::Open);
        let parts = self.parts(done, left);
        Work { parts, at: self.at, next, ends: self.nulls <= 0.0 && !is_open }
    }

    /// The work before the search of simulated recording `k`, from 0, after so many runs of those before.
    pub(crate) fn null(&self, k: usize, runs: u64) -> Work {
        let (mut done, mut left) = (self.done, [0.0; 7]);
        let search: f64 = done.iter().take(OTHER).sum();
        let each = if k > 0 { runs as f64 / k as f64 } else { OF_NULL * search };
        done[FILES] = 1.0;
        (done[NULLS], left[NULLS]) = (runs as f64, each * (self.nulls - k as f64).max(0.0));
        Work { parts: self.parts(done, left), at: NULLS, next: 0.0, ends: k > 0 }
    }

    fn parts(&self, done: [f64; 7], left: [f64; 7]) -> Vec<Part> {
        let takes = |kind| match kind {
            OTHER => Takes::Runs(WINDOWED),
            VERDICT => Takes::Seconds(VERDICT_VALUE_S * self.values),
            FILES => Takes::Seconds(FILES_S),
            _ => Takes::Runs(1.0),
        };
        (0..done.len()).map(|kind| Part { takes: takes(kind), done: done[kind], left: left[kind] }).collect()
    }

    /// What usually follows, and how often.
    fn later(&self) -> Vec<(Course, f64)> {
        let [n, _] = self.candidates;
        let n = n as usize;
        let again = [(Course::Again(n), 1.0)];
        match self.course {
            Course::Fit => [(Course::Screen, 1.0), (Course::Refit, 1.0)].into_iter().chain(again).collect(),
            Course::Screen => [(Course::Refit, 1.0)].into_iter().chain(again).collect(),
            Course::Refit => again.into(),
            Course::Again(n) => vec![(Course::Beside(1), HALF), (Course::Last(n), HALF)],
            Course::Beside(_) => vec![(Course::Last(n), 1.0)],
            Course::Last(_) | Course::Open | Course::Over => Vec::new(),
        }
    }

    /// Runs of a course by kinds of work.
    fn of(&self, course: Course) -> [f64; 7] {
        let [_, n_point] = self.candidates;
        let iteration = self.moved + 3.0;
        let (kind, points) = match course {
            Course::Fit => (FIT, ITERATIONS * iteration),
            Course::Screen => (SCREEN, n_point * (1.0 + AGAIN)),
            Course::Refit => (REFIT, REFITS * OF_REFIT * iteration),
            Course::Again(n) | Course::Last(n) => (SCREEN, n as f64 * (1.0 + AGAIN)),
            Course::Beside(n) => (REFIT, n as f64 * OF_REFIT * iteration),
            Course::Open | Course::Over => (OTHER, 0.0),
        };
        let mut runs = [0.0; 7];
        runs[kind] = self.records * points;
        runs
    }
}

#[cfg(test)]
mod tests;
