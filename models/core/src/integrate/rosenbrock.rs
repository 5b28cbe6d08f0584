//! The stiffly accurate Rosenbrock pair of order 4(3) with six stages, RODAS (Hairer & Wanner 1996, §IV.7).
//!
//! L-stable: what decays much faster than the step is long is damped at once. The Jacobian is the model's own where it has
//! one, else finite differences; one factorisation per attempt. Next file to read: `control.rs`.

use nalgebra::{DMatrix, DVectorViewMut, Dyn, LU};

use super::Tolerance;
use super::stepper::{Stepper, scaled};
use super::system::System;

const STAGES: usize = 6;
const GAMMA: f64 = 0.25;
/// Times of the stages within the step.
const ALPHA: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// Weights of the rate's time derivative.
const TIME: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0];
/// Weights of earlier stages in the state at which a stage takes its rate.
const A: [&[f64]; STAGES] = [
    &[],
    &[1.544],
    &[0.946_678_528_081_582_6, 0.255_701_169_898_328_4],
    &[3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7],
    &[1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895],
    &[1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0],
];
/// Weights of earlier stages, divided by the step, in a stage's right-hand side.
const C: [&[f64]; STAGES] = [
    &[],
    &[-5.6688],
    &[-2.430_093_356_833_875, -0.206_359_915_709_191_5],
    &[-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16],
    &[7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6],
    &[
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];

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
