//! Which side of each switching function the state is on, and when it changes.
//!
//! It evaluates and remembers; [`super::control`] narrows the change down. Next file to read: [`super::sliding`].

use super::system::System;

/// The switching functions of one integration.
pub(super) struct Events {
    /// Whether each function is at or above zero.
    sides: Vec<bool>,
    /// Values at the current point.
    before: Vec<f64>,
    /// Values at the end of the last attempt.
    after: Vec<f64>,
    /// The function that changes first.
    tracked: usize,
}

impl Events {
    pub(super) fn new(n: usize) -> Self {
        Self { sides: vec![true; n], before: vec![0.0; n], after: vec![0.0; n], tracked: 0 }
    }

    /// Takes the sides at a point.
    pub(super) fn begin<S: System>(&mut self, system: &mut S, t: f64, x: &[f64]) {
        if self.sides.is_empty() {
            return;
        }
        system.switches(t, x, &mut self.before);
        for (side, g) in self.sides.iter_mut().zip(&self.before) {
            *side = *g >= 0.0;
        }
    }

    /// Whether some function is on another side at `(t, x)`; tracks the one that a straight line lets change first.
    #[inline]
    pub(super) fn changed<S: System>(&mut self, system: &mut S, t: f64, x: &[f64]) -> bool {
        if self.sides.is_empty() {
            return false;
        }
        system.switches(t, x, &mut self.after);
        let mut first = f64::INFINITY;
        for (i, side) in self.sides.iter().enumerate() {
            let (g0, g1) = (self.before[i], self.after[i]);
            if !g1.is_nan() && (g1 >= 0.0) != *side {
                let share = (g0 / (g0 - g1)).clamp(0.0, 1.0);
                if share < first {
                    first = share;
                    self.tracked = i;
                }
            }
        }
        first.is_finite()
    }

    /// Values of the tracked function at the current point and at the last attempt's end.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.before[self.tracked], self.after[self.tracked]]
    }

    /// Whether a function is at or above zero at the current point.
    pub(super) fn side(&self, index: usize) -> bool {
        self.sides[index]
    }

    /// The function that the last change was about.
    pub(super) fn tracked(&self) -> usize {
        self.tracked
    }

    /// The last attempt was accepted without a change.
    #[inline]
    pub(super) fn passed(&mut self) {
        std::mem::swap(&mut self.before, &mut self.after);
    }
}
