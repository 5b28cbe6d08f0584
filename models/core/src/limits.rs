//! What one run may cost: the steps of its integrator, counted, its time, and a caller's word to stop.
//!
//! The count speaks of the model and the study alone, so that every place ends a run at the same step. No clock is here: a
//! caller that has one, or that no longer wants the answer, passes a function that says so, and the run looks at it between
//! steps. Next file to read: [`crate::simulator`], which sets the limits of a run.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::ModelFailure;

/// Steps of one run where the study does not say otherwise.
pub const MAX_STEPS: u64 = 2_000_000;

/// Seconds of computing of one run where the study does not say otherwise.
pub(crate) const TIMEOUT: f64 = 3600.0;

/// Steps between two looks at whether to stop: a look may read a clock, a step may be as short.
const LOOK: u64 = 256;

/// A caller's word that nobody wants the answer of a run any more.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Says it.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was said.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What may end a run before its end.
#[derive(Clone, Copy)]
pub struct Until<'a> {
    /// Tells the seconds that the run has computed so far.
    pub spent: &'a dyn Fn() -> f64,
    /// Whether nobody wants the answer any more.
    pub stop: &'a Stop,
    /// Where the run belongs in a trace, `traceparent` of the W3C recommendation "Trace Context"; handed to a program outside.
    pub traceparent: Option<&'a str>,
}

/// The limits of one run, and how much of them is used.
pub struct Limits<'a> {
    most: u64,
    taken: Cell<u64>,
    until: f64,
    stop: Option<&'a dyn Fn() -> bool>,
    stopped: Cell<bool>,
}

impl<'a> Limits<'a> {
    /// At most `most` steps for a run that ends at time `until`, and an end as soon as `stop` says so.
    pub(crate) fn new(most: u64, until: f64, stop: Option<&'a dyn Fn() -> bool>) -> Self {
        Self { most, taken: Cell::new(0), until, stop, stopped: Cell::new(false) }
    }

    /// No limits.
    pub fn none() -> Self {
        Self::new(u64::MAX, f64::NAN, None)
    }

    /// At most `most` steps and no other limit.
    pub fn at_most(most: u64) -> Self {
        Self::new(most, f64::NAN, None)
    }

    /// Counts so many steps that begin at time `t`.
    ///
    /// # Errors
    /// [`ModelFailure::TooManySteps`] beyond the limit, and when the run is to stop; [`Limits::stopped`] tells which.
    pub fn take(&self, steps: u64, t: f64) -> Result<(), ModelFailure> {
        let before = self.taken.get();
        let taken = before.saturating_add(steps);
        self.taken.set(taken);
        if taken > self.most {
            return Err(self.exceeded(t));
        }
        if taken / LOOK > before / LOOK && self.stop.is_some_and(|stop| stop()) {
            self.stopped.set(true);
            return Err(self.exceeded(t));
        }
        Ok(())
    }

    /// Refuses steps of length `dt` from time `t` on, where the rest of the run would need more than twice the steps that are
    /// left: a run that cannot end is not begun.
    ///
    /// # Errors
    /// [`ModelFailure::TooManySteps`].
    pub fn foresee(&self, dt: f64, t: f64) -> Result<(), ModelFailure> {
        let left = self.most.saturating_sub(self.taken.get());
        if (self.until - t) / dt > 2.0 * left as f64 { Err(self.exceeded(t)) } else { Ok(()) }
    }

    /// The steps that one span of linear inputs may take: those of the run, or `usual` where the run has no limit.
    pub(crate) fn in_one_span(&self, usual: u64) -> u64 {
        if self.most == u64::MAX { usual } else { self.most }
    }

    /// Whether the run ended because it was to stop.
    pub(crate) fn stopped(&self) -> bool {
        self.stopped.get()
    }

    fn exceeded(&self, time: f64) -> ModelFailure {
        ModelFailure::TooManySteps { time, limit: self.most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_ends_at_the_step_after_its_limit_and_is_not_begun_where_it_cannot_end() {
        let limits = Limits::new(1000, 8.0, None);
        assert_eq!(limits.take(1000, 0.5), Ok(()));
        assert_eq!(limits.take(1, 0.5), Err(ModelFailure::TooManySteps { time: 0.5, limit: 1000 }));
        assert!(!limits.stopped());
        let limits = Limits::new(1000, 8.0, None);
        assert_eq!(limits.foresee(8e-3, 0.0), Ok(()));
        assert_eq!(limits.foresee(3e-3, 0.0), Err(ModelFailure::TooManySteps { time: 0.0, limit: 1000 }));
        assert_eq!(limits.foresee(3e-3, 6.0), Ok(()));
        // Steps of no length, and without limits.
        assert!(limits.foresee(0.0, 0.0).is_err());
        assert_eq!(Limits::none().foresee(1e-300, 0.0), Ok(()));
    }

    #[test]
    fn a_run_that_is_to_stop_stops_within_a_few_steps_and_says_so() {
        let stop = || true;
        let limits = Limits::new(u64::MAX, 1.0, Some(&stop));
        let taken = (0..1000).take_while(|_| limits.take(1, 0.0).is_ok()).count();
        assert_eq!(taken, LOOK as usize - 1);
        assert!(limits.stopped());
    }
}
