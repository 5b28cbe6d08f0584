//! The uncertainty of a root mean square: the bootstrap of moving blocks, for correlated residuals.
//!
//! Drawing single values would treat them as independent; blocks keep the correlation of neighbours. Next file to read:
//! [`super::places`].

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starlings_estimators::effective_sample_size;

/// Ensembles drawn for an interval.
pub(super) const DRAWS: usize = 200;

/// 95 % interval of the root mean square of a series, by `n` draws of moving blocks (Künsch, Annals of Statistics 17, 1989).
///
/// The blocks overlap and are drawn with replacement until the length of the series is reached, the last one being cut. The
/// same seed gives the same bits. NaN for an empty series or without a draw.
pub(crate) fn block_bootstrap_rms(residuals: &[f64], block: usize, n: usize, seed: u64) -> [f64; 2] {
    let length = residuals.len();
    if length == 0 || n == 0 {
        return [f64::NAN; 2];
    }
    let block = block.clamp(1, length);
    let mut sums = vec![0.0; length + 1];
    for (i, e) in residuals.iter().enumerate() {
        sums[i + 1] = sums[i] + e * e;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draws: Vec<f64> = (0..n)
        .map(|_| {
            let (mut sum, mut left) = (0.0, length);
            while left > 0 {
                let take = block.min(left);
                let start = rng.random_range(0..=length - block);
                sum += sums[start + take] - sums[start];
                left -= take;
            }
            (sum.max(0.0) / length as f64).sqrt()
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let at = |share: f64| draws[((share * n as f64) as usize).min(n - 1)];
    [at(0.025), at(0.975)]
}

/// Length of the blocks for a series: twice the values that amount to one independent value, at least the cube root of the
/// length (the order that Künsch finds best) and at most a quarter of it.
pub(crate) fn block_length(series: &[f64]) -> usize {
    let n = series.len() as f64;
    let effective = effective_sample_size(series);
    let memory = if effective > 0.0 { 2.0 * n / effective } else { 1.0 };
    (memory.max(n.cbrt()).min(n / 4.0).ceil() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    fn series(n: usize, memory: f64, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut last: f64 = StandardNormal.sample(&mut rng);
        (0..n)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                last = memory * last + (1.0 - memory * memory).sqrt() * e;
                last
            })
            .collect()
    }

    #[test]
    fn the_interval_covers_the_true_root_mean_square_of_white_and_of_slow_residuals() {
        for (memory, least) in [(0.0, 175), (0.9, 150)] {
            let covered = (0..200)
                .filter(|seed| {
                    let e = series(600, memory, *seed);
                    let [lo, hi] = block_bootstrap_rms(&e, block_length(&e), DRAWS, *seed);
                    lo <= 1.0 && 1.0 <= hi
                })
                .count();
            // 190 expected; percentile intervals of 30 independent values fall short of their level by up to 15 %.
            assert!(covered >= least, "{covered} of 200 with memory {memory}");
        }
    }

    #[test]
    fn slow_residuals_have_a_wider_interval_than_single_draws_would_give() {
        let e = series(600, 0.95, 3);
        let width = |block| {
            let [lo, hi] = block_bootstrap_rms(&e, block, DRAWS, 1);
            hi - lo
        };
        // About 20 values amount to one, so the width differs by a factor of about 4; 2 leaves room for the draw.
        assert!(width(block_length(&e)) > 2.0 * width(1));
    }

    #[test]
    fn no_values_have_no_interval() {
        assert!(block_bootstrap_rms(&[], 3, DRAWS, 1)[0].is_nan());
    }
}
