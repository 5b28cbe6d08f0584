//! Noise with a memory: white noise plus a stationary Ornstein–Uhlenbeck process, and the linear map that whitens it.
//!
//! The process is Markov, so that the Kalman filter (Kalman 1960) gives density and innovations of n values in O(n), at whatever
//! times they were taken: gaps and unequal steps need no care (Jones 1981, Applied Time Series Analysis II, for an autoregression of
//! order one). The innovations over their standard deviations are L⁻¹ e, with L the lower Cholesky factor of the covariance. Read
//! next: `correlated_noise/fit.rs`, its maximum likelihood.

mod fit;
#[cfg(test)]
mod tests;

pub use fit::{FittedNoise, Part, Series, fit_noise};

/// Covariance of two values a time d apart: `correlated` exp(−d / `length`), and `white` more where they are the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelatedNoise {
    /// Variance of the white part, above zero.
    pub white: f64,
    /// Variance of the correlated part.
    pub correlated: f64,
    /// Time over which the correlation falls to 1/e, above zero.
    pub length: f64,
}

impl CorrelatedNoise {
    /// Makes values (n) at increasing times (n) white and of variance one: L⁻¹ e. Linear in them. With a white part of one and no
    /// correlated part they keep their bits.
    pub fn whiten(&self, times: &[f64], values: &mut [f64]) {
        let mut filter = Filter::new(self);
        for (t, e) in times.iter().zip(values) {
            let variance = filter.predict(*t);
            let innovation = *e - filter.mean;
            filter.update(innovation, variance);
            *e = innovation / variance.sqrt();
        }
    }

    /// The inverse of [`CorrelatedNoise::whiten`]: L v, which makes this noise of independent values (n) of variance one.
    pub fn colour(&self, times: &[f64], values: &mut [f64]) {
        let mut filter = Filter::new(self);
        for (t, v) in times.iter().zip(values) {
            let variance = filter.predict(*t);
            let innovation = *v * variance.sqrt();
            *v = filter.mean + innovation;
            filter.update(innovation, variance);
        }
    }

    /// Logarithm of the density of values (n) at increasing times (n).
    pub fn log_density(&self, times: &[f64], values: &[f64]) -> f64 {
        let mut filter = Filter::new(self);
        let mut twice = 0.0;
        // With equal steps the variance settles, and its logarithm is the costliest part.
        let (mut last, mut log) = (f64::NAN, f64::NAN);
        for (t, e) in times.iter().zip(values) {
            let variance = filter.predict(*t);
            let innovation = e - filter.mean;
            filter.update(innovation, variance);
            if variance.to_bits() != last.to_bits() {
                (last, log) = (variance, (std::f64::consts::TAU * variance).ln());
            }
            twice += log + innovation * innovation / variance;
        }
        -0.5 * twice
    }
}

/// The Kalman filter of the correlated part.
struct Filter<'a> {
    noise: &'a CorrelatedNoise,
    /// Mean and variance of the correlated part, given the values so far.
    mean: f64,
    variance: f64,
    time: f64,
    /// The last step of time with its decay and the variance that it adds: most recordings have one step.
    step: (f64, f64, f64),
}

impl<'a> Filter<'a> {
    fn new(noise: &'a CorrelatedNoise) -> Self {
        Self { noise, mean: 0.0, variance: noise.correlated, time: f64::NAN, step: (f64::NAN, 0.0, 0.0) }
    }

    /// Goes on to a time; variance of the next value.
    fn predict(&mut self, time: f64) -> f64 {
        if !self.time.is_nan() {
            let apart = time - self.time;
            if apart.to_bits() != self.step.0.to_bits() {
                let lag = apart / self.noise.length;
                self.step = (apart, (-lag).exp(), self.noise.correlated * -(-2.0 * lag).exp_m1());
            }
            let (_, decay, added) = self.step;
            self.mean *= decay;
            self.variance = decay * decay * self.variance + added;
        }
        self.time = time;
        self.variance + self.noise.white
    }

    fn update(&mut self, innovation: f64, variance: f64) {
        self.mean += self.variance / variance * innovation;
        self.variance *= self.noise.white / variance;
    }
}
