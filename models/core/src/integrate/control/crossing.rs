//! The step up to a switching point and across it.
//!
//! Next file to read: [`super::super::events`].

use super::{Run, Step};
use crate::failure::ModelFailure;
use crate::integrate::stepper::Stepper;
use crate::integrate::system::System;

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
            if !self.new.iter().all(|v| v.is_finite()) {
                return Err(self.culprit(gap));
            }
            let target = if self.end - self.t <= gap { self.end } else { self.t + gap };
            self.accept(gap, target);
        }
        self.events.begin(self.system, self.t, self.x);
        self.stepper.restart(self.system, self.t, self.x);
        self.h = h;
        self.last_error = 1e-4;
        Ok(Step::Crossed)
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
            let changed = self.events.changed(self.system, self.t + at, &self.new);
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
