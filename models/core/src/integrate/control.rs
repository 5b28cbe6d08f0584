//! The choice of steps: proportional–integral control (Gustafsson 1991; Hairer, Nørsett & Wanner 1993, §II.4), limits, and
//! restarts at switching points.
//!
//! It knows no formulas of a method. Next file to read: `control/crossing.rs`.

mod crossing;

use super::Tolerance;
use super::events::Events;
use super::stepper::{MAX_STEPS, Stepper, scaled};
use super::system::{System, not_finite};
use crate::failure::ModelFailure;
use crate::scratch::Scratch;

const SAFETY: f64 = 0.9;
/// Weight of the integral part.
const BETA: f64 = 0.04;
/// Smallest and largest factor between two steps.
const FACTOR: [f64; 2] = [0.1, 8.0];

/// What one attempt at a step came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// Accepted.
    Passed,
    /// Accepted up to and across a switching point.
    Crossed,
    /// Too inexact; the next attempt is shorter.
    Refused,
    /// Accepted, and the method gives up for stiffness.
    Stiff,
}

/// One integration under way.
pub(super) struct Run<'a, S, P> {
    pub(super) system: &'a mut S,
    pub(super) stepper: &'a mut P,
    pub(super) t: f64,
    pub(super) end: f64,
    pub(super) x: &'a mut [f64],
    pub(super) tolerance: Tolerance,
    pub(super) events: Events,
    new: Scratch,
    /// Length of the next attempt.
    h: f64,
    /// Shortest step that still moves the clock.
    shortest: f64,
    /// Error of the last accepted step, for the integral part.
    last_error: f64,
    pub(super) steps: u64,
    /// Whether no step was accepted yet.
    pub(super) fresh: bool,
    /// Switching points since the time beside it.
    crossings: (u32, f64),
    /// Whether the present rate leads across a switching surface within the step that was refused last.
    faces_switch: bool,
}

impl<'a, S: System, P: Stepper> Run<'a, S, P> {
    pub(super) fn new(
        system: &'a mut S,
        stepper: &'a mut P,
        [t, end]: [f64; 2],
        x: &'a mut [f64],
        tolerance: Tolerance,
    ) -> Self {
        let events = Events::new(system.n_switch());
        let shortest = 16.0 * f64::EPSILON * t.abs().max(end.abs());
        let new = Scratch::new(x.len());
        Self {
            system,
            stepper,
            t,
            end,
            x,
            tolerance,
            events,
            new,
            h: 0.0,
            shortest,
            last_error: 1e-4,
            steps: 0,
            fresh: true,
            crossings: (0, t),
            faces_switch: false,
        }
    }

    /// Evaluates the starting point and guesses the first step.
    pub(super) fn start(&mut self) -> Result<(), ModelFailure> {
        self.stepper.restart(self.system, self.t, self.x);
        let rate = self.stepper.rate();
        if !rate.iter().all(|v| v.is_finite()) {
            return Err(not_finite(self.system, self.t, rate));
        }
        self.h = self.first_step();
        self.last_error = 1e-4;
        self.events.begin(self.system, self.t, self.x);
        Ok(())
    }

    /// A tenth of the time in which the state would change by itself at the present rate. It costs no evaluation, since spans
    /// are often shorter than the step could be; a bad guess costs one refused step.
    fn first_step(&self) -> f64 {
        let span = self.end - self.t;
        let (mut state, mut rate) = (0.0, 0.0);
        for (x, f) in self.x.iter().zip(self.stepper.rate()) {
            state += scaled(*x, *x, *x, self.tolerance).powi(2);
            rate += scaled(*f, *x, *x, self.tolerance).powi(2);
        }
        let guess = 0.1 * (state / rate).sqrt();
        if guess.is_finite() { guess.clamp(1e-4 * span, span) } else { span }
    }

    /// One attempt at a step.
    pub(super) fn step(&mut self) -> Result<Step, ModelFailure> {
        let left = self.end - self.t;
        let last = self.h * 1.01 >= left;
        let h = if last { left } else { self.h };
        let error = self.attempt(h)?;
        if error.is_finite() && self.events.changed(self.system, self.t + h, self.new.as_ref()) {
            return self.cross(h);
        }
        if error.is_nan() || error > 1.0 {
            return self.refuse(h, error);
        }
        let stiff = self.accept(h, if last { self.end } else { self.t + h });
        if !last {
            self.h = h * self.factor(error);
            self.last_error = error.max(1e-4);
        }
        Ok(if stiff { Step::Stiff } else { Step::Passed })
    }

    fn attempt(&mut self, h: f64) -> Result<f64, ModelFailure> {
        self.system.limits().take(1, self.t)?;
        self.steps += 1;
        let limit = self.system.limits().in_one_span(MAX_STEPS);
        if self.steps > limit {
            return Err(ModelFailure::TooManySteps { time: self.t, limit });
        }
        Ok(self.stepper.attempt(self.system, self.t, self.x, h, self.new.as_mut(), self.tolerance))
    }

    fn accept(&mut self, h: f64, target: f64) -> bool {
        self.t = target;
        self.x.copy_from_slice(self.new.as_ref());
        self.events.passed();
        self.fresh = false;
        self.stepper.accept(self.system, self.t, h, self.x)
    }

    /// Factor to the next step after an accepted one.
    fn factor(&self, error: f64) -> f64 {
        let alpha = 1.0 / P::ORDER - 0.75 * BETA;
        (SAFETY * error.max(1e-10).powf(-alpha) * self.last_error.powf(BETA)).clamp(FACTOR[0], FACTOR[1])
    }

    fn refuse(&mut self, h: f64, error: f64) -> Result<Step, ModelFailure> {
        let factor = if error.is_finite() {
            (SAFETY * error.powf(-1.0 / P::ORDER)).clamp(FACTOR[0], 0.9)
        } else {
            0.1
        };
        self.h = h * factor;
        self.look_ahead(h);
        if self.h >= self.shortest {
            return Ok(Step::Refused);
        }
        if self.new.as_ref().iter().all(|v| v.is_finite()) {
            return Err(ModelFailure::StepTooSmall { time: self.t, step: self.h });
        }
        Err(self.culprit(h))
    }

    /// The state whose rate stops being finite just ahead; a method's stages spread the fault over all of them.
    fn culprit(&mut self, h: f64) -> ModelFailure {
        let (mut ahead, mut rate) = (self.x.to_vec(), self.x.to_vec());
        for (x, f) in ahead.iter_mut().zip(self.stepper.rate()) {
            *x += h * f;
        }
        self.system.rhs(self.t + h, &ahead, &mut rate);
        let found = if rate.iter().all(|v| v.is_finite()) { self.new.as_ref() } else { &rate };
        not_finite(self.system, self.t, found)
    }
}
