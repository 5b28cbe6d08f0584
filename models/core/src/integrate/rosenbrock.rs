//! The stiffly accurate Rosenbrock pair of order 4(3) with six stages, RODAS (Hairer & Wanner 1996, §IV.7).
//!
//! L-stable: what decays much faster than the step is long is damped at once. The Jacobian is the model's own where it has
//! one, else finite differences; one factorisation per attempt. Next file to read: `control.rs`.

use nalgebra::{DMatrix, DVectorViewMut, Dyn, LU};

use super::Tolerance;
use super::rodas::{A, ALPHA, C, GAMMA, STAGES, TIME};
use super::stepper::{Stepper, scaled};
use super::system::System;

/// The pair's working memory.
pub(super) struct Rosenbrock {
    n: usize,
    /// Rate, its time derivative, six stages, one state, two of scratch.
    work: Vec<f64>,
    dfdx: Vec<f64>,
    /// The iteration matrix.
    matrix: DMatrix<f64>,
}

impl Rosenbrock {
    pub(super) fn new(n: usize) -> Self {
        Self { n, work: vec![0.0; (STAGES + 5) * n], dfdx: vec![0.0; n * n], matrix: DMatrix::zeros(n, n) }
    }

    /// I/(γh) − ∂f/∂x, factorised.
    fn factorise(&mut self, h: f64) -> LU<f64, Dyn, Dyn> {
        for (m, j) in self.matrix.as_mut_slice().iter_mut().zip(&self.dfdx) {
            *m = -j;
        }
        for i in 0..self.n {
            self.matrix[(i, i)] += 1.0 / (GAMMA * h);
        }
        LU::new(self.matrix.clone())
    }
}

impl Stepper for Rosenbrock {
    const ORDER: f64 = 4.0;

    fn restart<S: System>(&mut self, system: &mut S, t: f64, x: &[f64]) {
        let (f, rest) = self.work.split_at_mut(self.n);
        let (dfdt, rest) = rest.split_at_mut(self.n);
        let scratch = &mut rest[(STAGES + 1) * self.n..];
        system.rhs(t, x, f);
        system.jacobian(t, x, f, &mut self.dfdx, dfdt, scratch);
    }

    fn rate(&self) -> &[f64] {
        &self.work[..self.n]
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
        let lu = self.factorise(h);
        let (f, rest) = self.work.split_at_mut(n);
        let (dfdt, rest) = rest.split_at_mut(n);
        let (stages, rest) = rest.split_at_mut(STAGES * n);
        let rate = &mut rest[..n];
        for i in 0..STAGES {
            let (done, here) = stages.split_at_mut(i * n);
            let here = &mut here[..n];
            if i == 0 {
                rate.copy_from_slice(f);
            } else {
                new.copy_from_slice(x);
                for (k, a) in done.chunks_exact(n).zip(A[i]) {
                    new.iter_mut().zip(k).for_each(|(new, k)| *new += a * k);
                }
                system.rhs(t + ALPHA[i] * h, new, rate);
            }
            for ((k, rate), dfdt) in here.iter_mut().zip(rate.iter()).zip(dfdt.iter()) {
                *k = rate + TIME[i] * h * dfdt;
            }
            for (k, c) in done.chunks_exact(n).zip(C[i]) {
                here.iter_mut().zip(k).for_each(|(here, k)| *here += c / h * k);
            }
            if !lu.solve_mut(&mut DVectorViewMut::from_slice(here, n)) {
                new.fill(f64::NAN);
                return f64::NAN;
            }
        }
        // Stiffly accurate: the result is the last stage's state plus the last stage, which is also the error.
        let error = &stages[(STAGES - 1) * n..];
        let mut sum = 0.0;
        for ((new, e), x) in new.iter_mut().zip(error).zip(x) {
            *new += e;
            sum += scaled(*e, *x, *new, tolerance).powi(2);
        }
        (sum / n as f64).sqrt()
    }

    fn accept<S: System>(&mut self, system: &mut S, t: f64, _: f64, new: &[f64]) -> bool {
        self.restart(system, t, new);
        false
    }
}
