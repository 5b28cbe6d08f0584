//! The embedded Runge–Kutta pair of order 5(4) by Dormand & Prince (1980), with local extrapolation.
//!
//! The last stage is the next step's first. Stiffness is detected as in DOPRI5 (Hairer, Nørsett & Wanner 1993, §IV.2).
//! Next file to read: `control.rs`, which chooses the steps.

use super::Tolerance;
use super::stepper::{Stepper, scaled};
use super::system::System;
use crate::scratch::ShortVec;

/// The pair's working memory: seven rates and one stage.
pub(super) struct Dopri5 {
    work: ShortVec<WORK>,
    n: usize,
    /// Whether to look for stiffness.
    watch: bool,
    stiff: u32,
    not_stiff: u32,
}

/// Numbers of working memory on the stack: those of eight states.
const WORK: usize = 64;

const C: [f64; 4] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0];
const A2: f64 = 1.0 / 5.0;
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
const A6: [f64; 5] = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
/// Weights of stages 1, 3, 4, 5, 6 in the result of order 5.
const B: [f64; 5] = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
/// The same for the difference between the results of order 5 and 4, and stage 7.
const E: [f64; 6] =
    [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
/// Where the negative real axis leaves the region of stability.
const STABILITY: f64 = 3.25;

impl Dopri5 {
    pub(super) fn new(n: usize, watch: bool) -> Self {
        Self { work: ShortVec::new(8 * n), n, watch, stiff: 0, not_stiff: 0 }
    }
}

impl Stepper for Dopri5 {
    const ORDER: f64 = 5.0;

    fn restart<S: System>(&mut self, system: &mut S, t: f64, x: &[f64]) {
        system.rhs(t, x, &mut self.work.as_mut()[..self.n]);
        (self.stiff, self.not_stiff) = (0, 0);
    }

    fn rate(&self) -> &[f64] {
        &self.work.as_ref()[..self.n]
    }

    fn attempt<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        x: &[f64],
        h: f64,
        new: &mut [f64],
        tolerance: Tolerance,
    ) -> f64 {
        let n = self.n;
        let (k1, rest) = self.work.as_mut().split_at_mut(n);
        let (k2, rest) = rest.split_at_mut(n);
        let (k3, rest) = rest.split_at_mut(n);
        let (k4, rest) = rest.split_at_mut(n);
        let (k5, rest) = rest.split_at_mut(n);
        let (k6, rest) = rest.split_at_mut(n);
        let (k7, stage) = rest.split_at_mut(n);
        let (x, new) = (&x[..n], &mut new[..n]);
        let stage = &mut stage[..n];
        for i in 0..n {
            stage[i] = x[i] + h * A2 * k1[i];
        }
        system.rhs(t + C[0] * h, stage, k2);
        for i in 0..n {
            stage[i] = x[i] + h * (A3[0] * k1[i] + A3[1] * k2[i]);
        }
        system.rhs(t + C[1] * h, stage, k3);
        for i in 0..n {
            stage[i] = x[i] + h * (A4[0] * k1[i] + A4[1] * k2[i] + A4[2] * k3[i]);
        }
        system.rhs(t + C[2] * h, stage, k4);
        for i in 0..n {
            stage[i] = x[i] + h * (A5[0] * k1[i] + A5[1] * k2[i] + A5[2] * k3[i] + A5[3] * k4[i]);
        }
        system.rhs(t + C[3] * h, stage, k5);
        for i in 0..n {
            stage[i] =
                x[i] + h * (A6[0] * k1[i] + A6[1] * k2[i] + A6[2] * k3[i] + A6[3] * k4[i] + A6[4] * k5[i]);
        }
        system.rhs(t + h, stage, k6);
        for i in 0..n {
            new[i] = x[i] + h * (B[0] * k1[i] + B[1] * k3[i] + B[2] * k4[i] + B[3] * k5[i] + B[4] * k6[i]);
        }
        system.rhs(t + h, new, k7);
        let mut sum = 0.0;
        for i in 0..n {
            let e = E[0] * k1[i] + E[1] * k3[i] + E[2] * k4[i] + E[3] * k5[i] + E[4] * k6[i] + E[5] * k7[i];
            sum += scaled(h * e, x[i], new[i], tolerance).powi(2);
        }
        (sum / n as f64).sqrt()
    }

    fn accept<S: System>(&mut self, _: &mut S, _: f64, h: f64, new: &[f64]) -> bool {
        if self.watch {
            self.look_for_stiffness(h, new);
        }
        self.work.as_mut().copy_within(6 * self.n..7 * self.n, 0);
        self.stiff >= 15
    }
}

impl Dopri5 {
    /// Two stages at the same time give an estimate of the dominant eigenvalue; h·|λ| beyond the region of stability, step
    /// after step, means that stability and not accuracy sets the step.
    fn look_for_stiffness(&mut self, h: f64, new: &[f64]) {
        let n = self.n;
        let work = self.work.as_ref();
        let (k6, k7, stage) = (&work[5 * n..6 * n], &work[6 * n..7 * n], &work[7 * n..]);
        let (mut rates, mut states) = (0.0, 0.0);
        for i in 0..n {
            rates += (k7[i] - k6[i]).powi(2);
            states += (new[i] - stage[i]).powi(2);
        }
        if states > 0.0 && h * h * rates > STABILITY * STABILITY * states {
            self.not_stiff = 0;
            self.stiff += 1;
        } else if self.stiff > 0 {
            self.not_stiff += 1;
            if self.not_stiff == 6 {
                self.stiff = 0;
            }
        }
    }
}
