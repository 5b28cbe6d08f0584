//! Where an inference stands: its stages, with the work of all of them in steps of the recordings.
//!
//! Next file to read: `run.rs`.

use starlings_fleet::Fleet;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};
use starlings_study::{Part, Takes, Work};

use crate::blocks::{Cut, Start, length};

/// Rounds of smoothing that are expected before their growth tells more.
const ROUNDS: f64 = 20.0;
/// Growths of the likelihood from which the rounds that follow are told.
const GROWTHS: usize = 4;
/// A round of smoothing takes as long as the sums of so many times its steps.
const ROUND: f64 = 30.0;

/// Where an inference stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What is being done: `sums`, `smoothing` or `posterior`.
    pub stage: &'static str,
    /// More of it, in a few words.
    pub says: String,
    /// Blocks whose sums are there.
    pub n_block: u64,
    /// Workers now.
    pub workers: usize,
    /// How much of the work is done.
    pub work: Work,
}

/// Tells it, from what is known of the recordings beforehand.
pub(crate) struct Teller<'a> {
    watch: &'a mut dyn FnMut(&Progress),
    /// Steps of a block, and of all recordings, by the lengths of their files.
    block: f64,
    n_step: f64,
    /// Steps of recordings that are done with.
    before: f64,
    /// Rounds of the smoothing that are expected.
    rounds: f64,
    last: Progress,
}

impl<'a> Teller<'a> {
    pub(crate) fn new(
        choice: &InferChoice,
        cut: Cut,
        at: Start,
        watch: &'a mut dyn FnMut(&Progress),
    ) -> Self {
        let held_out = choice.held_out.iter().filter(|_| choice.missing.is_some());
        let records = choice.records.iter().chain(held_out);
        let n_step: f64 = records.map(|record| length(record) as f64 / at.per_row).sum();
        let is_smoothed = matches!(choice.measured, MeasuredChoice::Known(_));
        let last = Progress { stage: "", says: String::new(), n_block: 0, workers: 0, work: Work::default() };
        let rounds = if is_smoothed { ROUNDS } else { 0.0 };
        Self { watch, block: cut.block as f64, n_step, before: 0.0, rounds, last }
    }

    /// So many blocks of the recordings that are read have sums, with so many steps; as many as `next` are being made.
    pub(crate) fn sums(&mut self, n_block: u64, n_step: u64, next: usize, fleet: &dyn Fleet) {
        let done = self.before + n_step as f64;
        let next = (next as f64 * self.block).min((self.n_step - done).max(0.0));
        let says = format!("{done:.0} of about {:.0} steps", self.n_step.max(done));
        let work = self.work([done, (self.n_step - done).max(0.0)], [0.0, self.rounds], 0, next);
        self.tell(Progress { stage: "sums", says, n_block, workers: fleet.n_workers(), work });
    }

    /// All blocks of one set of recordings are summed.
    pub(crate) fn summed(&mut self, n_step: u64) {
        self.before += n_step as f64;
    }

    /// A round of smoothing begins, after rounds with these log-likelihoods; it ends where one grows by less than `tolerance`, after `most`
    /// at the latest.
    pub(crate) fn round(&mut self, log_likelihood: &[f64], tolerance: f64, most: usize) {
        let n = log_likelihood.len() as f64;
        let rounds = rounds(log_likelihood, tolerance).clamp(n + 1.0, (most as f64).max(n + 1.0));
        let work = self.work([self.before, 0.0], [n, rounds - n], 1, 1.0);
        let says = format!("round {} of about {rounds:.0}", n + 1.0);
        self.tell(Progress { stage: "smoothing", says, work, ..self.last.clone() });
    }

    /// What is left is small.
    pub(crate) fn posterior(&mut self) {
        let mut work = Work { next: 0.0, ..self.last.work.clone() };
        for part in &mut work.parts {
            (part.done, part.left) = (part.done + part.left, 0.0);
        }
        self.tell(Progress { stage: "posterior", says: String::new(), work, ..self.last.clone() });
    }

    /// Done and left of the steps and of the rounds; `next` of the kind that goes on.
    fn work(&self, steps: [f64; 2], rounds: [f64; 2], at: usize, next: f64) -> Work {
        let part = |weight, [done, left]: [f64; 2]| Part { takes: Takes::Runs(weight), done, left };
        Work { parts: vec![part(1.0, steps), part(ROUND * self.n_step, rounds)], at, next, ends: true }
    }

    fn tell(&mut self, at: Progress) {
        (self.watch)(&at);
        self.last = at;
    }
}

/// Rounds in all, by a growth that falls from round to round by the same factor, as that of expectation and maximisation does in the end
/// (Dempster, Laird & Rubin 1977).
fn rounds(log_likelihood: &[f64], tolerance: f64) -> f64 {
    let growths: Vec<f64> = log_likelihood.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let n = log_likelihood.len() as f64;
    let Some(recent) = growths.len().checked_sub(GROWTHS).map(|from| &growths[from..]) else { return ROUNDS };
    let (first, last) = (recent[0], recent[GROWTHS - 1]);
    if !(first > last && last > tolerance) {
        return ROUNDS.max(n + 1.0);
    }
    let factor = (last / first).powf(1.0 / (GROWTHS - 1) as f64);
    n + (tolerance / last).ln() / factor.ln()
}

#[cfg(test)]
mod tests {
    use super::rounds;

    #[test]
    fn rounds_whose_growth_falls_evenly_end_when_it_is_told() {
        let mut log = vec![0.0_f64];
        for k in 0..40 {
            log.push(log[log.len() - 1] + 100.0 * 0.7_f64.powi(k));
        }
        // 100 · 0.7^k is below a thousandth from k = 33 on, which is the growth of round 35.
        for n in 6..30 {
            let told = rounds(&log[..n], 1e-3);
            assert!((told - 34.0).abs() < 1.5, "{told} after {n}");
        }
        assert!((rounds(&log[..3], 1e-3) - super::ROUNDS).abs() < 1e-12);
    }
}
