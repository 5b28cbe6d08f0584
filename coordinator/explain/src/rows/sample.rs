//! Rows and noise for tests.

use starlings_estimators::CorrelatedNoise;

use super::{Row, Rows, Usage};

impl Rows {
    /// One channel of n rows with noise 1 and the measured value zero, a step of time apart, each for the use that `usage` gives.
    pub(crate) fn sample(n: usize, usage: impl Fn(usize) -> Usage) -> Self {
        let row = |step: usize| {
            let (time, usage) = (step as f64, usage(step));
            Row {
                record: 0,
                channel: 0,
                output: 0,
                step,
                time,
                observed: 0.0,
                noise: 1.0,
                noise_freedom: f64::INFINITY,
                usage,
            }
        };
        let rows: Vec<Row> = (0..n).map(row).collect();
        let train = (0..n).filter(|i| rows[*i].usage == Usage::Train).collect();
        Self { train, rows, noise: Vec::new() }
    }

    /// One channel of n training rows whose values are this noise.
    pub(crate) fn of_noise(noise: CorrelatedNoise, n: usize, seed: u64) -> Self {
        let mut rows = Self::sample(n, |_| Usage::Train);
        rows.noise = vec![Some(noise)];
        let mut values = white(n, seed).as_slice().to_vec();
        rows.colour(0, &mut values);
        for (row, value) in rows.rows.iter_mut().zip(values) {
            row.observed = value;
        }
        rows.noise.clear();
        rows
    }
}

/// White noise of sd 1.
pub(crate) fn white(n: usize, seed: u64) -> nalgebra::DVector<f64> {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    nalgebra::DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random))
}
