//! The step up to a switching point and across it.
//!
//! Next file to read: [`super::super::events`].

use super::{Run, Step};
use crate::failure::ModelFailure;
use crate::integrate::stepper::Stepper;
use crate::integrate::system::System;
use crate::scratch::Scratch;

/// Switching points after which the way made is looked at ...
const MANY: u32 = 256;
/// ... and the least part of the rest of the span that they must have brought.
const LEAST_WAY: f64 = 1e-6;

impl<S: System, P: Stepper> Run<'_, S, P> {
    /// Steps up to the first switching point within `h` and across it, unless the step up to it is refused.
    pub(super) fn cross(&mut self, h: f64) -> Result<Step, ModelFailure> {
        let [before, after] = self.locate(h)?;
        if before > self.shortest {
            let error = self.attempt(before)?;
            if error.is_nan() || error > 1.0 {
                return self.refuse(before, error);
            }
            self.accept(before, self.t + before);
        }
        // The switching point lies within this step; it is so short that its error does not count.
        let gap = (after - before).max(self.shortest).min(self.end - self.t);
        if gap > 0.0 {
            self.attempt(gap)?;
            if !self.new.as_ref().iter().all(|v| v.is_finite()) {
                return Err(self.culprit(gap));
            }
            let target = if self.end - self.t <= gap { self.end } else { self.t + gap };
            self.accept(gap, target);
        }
        self.events.begin(self.system, self.t, self.x);
        self.stepper.restart(self.system, self.t, self.x);
        self.h = h;
        self.last_error = 1e-4;
        self.count_crossing()?;
        Ok(Step::Crossed)
    }

    /// Looks whether the present rate leads across a switching surface within a refused step of length `h`, and makes the next one
    /// end at it: a step with stages beyond the surface is inexact, and may end before it, where the rates there lead back.
    pub(super) fn look_ahead(&mut self, h: f64) {
        self.faces_switch = false;
        if self.system.n_switch() == 0 {
            return;
        }
        let mut ahead = Scratch::of(self.x);
        for (ahead, rate) in ahead.as_mut().iter_mut().zip(self.stepper.rate()) {
            *ahead += h * rate;
        }
        self.faces_switch = self.events.changed(self.system, self.t + h, ahead.as_ref());
        let [before, after] = self.events.ends();
        let share = before / (before - after);
        if self.faces_switch && share.is_finite() {
            self.h = self.h.min((h * share.clamp(0.0, 1.0)).max(2.0 * self.shortest));
        }
    }

    /// Whether the last step that was refused led across a switching surface.
    pub(in crate::integrate) fn faces_switch(&self) -> bool {
        self.faces_switch
    }

    /// Refuses to go on from side to side where that leads nowhere: the rest of the span would take millions of such steps.
    fn count_crossing(&mut self) -> Result<(), ModelFailure> {
        let (count, since) = self.crossings;
        self.crossings.0 = count + 1;
        if count + 1 < MANY {
            return Ok(());
        }
        self.crossings = (0, self.t);
        let way = self.t - since;
        if way < LEAST_WAY * (self.end - since) {
            return Err(ModelFailure::StepTooSmall { time: self.t, step: way / f64::from(MANY) });
        }
        Ok(())
    }

    /// Narrows the first change of side within `h` down to two step lengths, before and after it, by the Illinois variant of
    /// regula falsi (Dowell & Jarratt 1971) on repeated steps, safeguarded by bisection.
    fn locate(&mut self, h: f64) -> Result<[f64; 2], ModelFailure> {
        let narrow = (1e-12 * h).max(self.shortest);
        let mut bracket = [0.0, h];
        let mut weights = self.events.ends();
        let mut last_side = None;
        let mut tries = 0;
        while bracket[1] - bracket[0] > narrow && tries < 100 {
            let width = bracket[1] - bracket[0];
            let share = weights[0] / (weights[0] - weights[1]);
            let guess = if tries % 4 == 3 || !(0.0..=1.0).contains(&share) { 0.5 } else { share };
            // A guess next to an end is moved inwards, so that the bracket closes from both sides.
            let at = bracket[0] + (guess * width).clamp(0.45 * narrow, width - 0.45 * narrow);
            let error = self.attempt(at)?;
            let changed = self.events.changed(self.system, self.t + at, self.new.as_ref());
            let value = self.events.ends()[1];
            let side = usize::from(changed || !error.is_finite());
            (bracket[side], weights[side]) = (at, value);
            // The end that stays a second time counts half, so that it moves too.
            if last_side.replace(side) == Some(side) {
                weights[1 - side] *= 0.5;
            }
            tries += 1;
        }
        Ok(bracket)
    }
}
