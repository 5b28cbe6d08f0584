//! Since when a recording departs from its model, at a stated rate of false alarms.
//!
//! What is tested are standardised innovations, which are independent and of unit variance while the model holds ([`innovations`]). Every
//! stretch of a power of two of them, from single values to the whole series, is asked twice: for the sum of their squares and for the
//! square of their sum, which a slow drift moves first. All tests share the stated rate alike (Bonferroni), so that the rate holds
//! whatever their dependence; it is an upper bound. Next file to read: `scenarios.rs`, which asks what a departure is.

use nalgebra::{DMatrix, DVector};

use crate::quantiles::chi_squared_tail;

/// Tests of one stretch.
const PER_STRETCH: usize = 2;

/// Values that follow one another and what one test says of them.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Index of its first value.
    pub first: usize,
    /// Index of its last value.
    pub last: usize,
    /// χ² of the test.
    pub statistic: f64,
    /// Its degrees of freedom: the length of the stretch, or one for the square of the sum.
    pub degrees: usize,
    /// Probability that chance alone makes it as large, of this one test.
    pub tail: f64,
}

/// Standardised innovations of values whose residuals depend linearly on parameters with a Gaussian prior: each value's residual less
/// what the values before it say, over its standard deviation. They are independent and of unit variance.
///
/// `residual` (m) is observed less predicted over the noise at some point z, `jacobian` (m x p) the derivative of the prediction over
/// the noise by z, in units in which the prior is a standard normal. (Kalman 1960, for parameters that do not move.)
pub fn innovations(residual: &DVector<f64>, jacobian: &DMatrix<f64>, z: &DVector<f64>) -> Vec<f64> {
    let p = z.len();
    let mut mean = DVector::zeros(p);
    let mut spread = DMatrix::identity(p, p);
    let of_prior = residual + jacobian * z;
    let innovation = |(row, value): (usize, &f64)| {
        let slope = jacobian.row(row).transpose();
        let moved = &spread * &slope;
        let variance = 1.0 + slope.dot(&moved);
        let off = value - slope.dot(&mean);
        mean += &moved * (off / variance);
        spread -= &moved * moved.transpose() / variance;
        off / variance.sqrt()
    };
    of_prior.iter().enumerate().map(innovation).collect()
}

/// Tests that are made of a series of `n` values.
pub fn n_test(n: usize) -> usize {
    lengths(n).map(|length| PER_STRETCH * (n / length)).sum()
}

/// The stretch that ends first among those whose tail is below `level`, with the smallest tail of those that end there.
pub fn first_beyond(values: &[f64], level: f64) -> Option<Stretch> {
    let beyond = stretches(values).into_iter().filter(|stretch| stretch.tail < level);
    beyond.min_by(|a, b| a.last.cmp(&b.last).then(a.tail.total_cmp(&b.tail)))
}

/// The stretch that chance explains least; none of an empty series, or where no stretch is larger than expected.
pub fn strongest(values: &[f64]) -> Option<Stretch> {
    stretches(values).into_iter().min_by(|a, b| a.tail.total_cmp(&b.tail))
}

fn lengths(n: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(1_usize), |length| length.checked_mul(2))
        .take_while(move |length| *length <= n)
}

/// All stretches whose χ² exceeds its mean; of the others nothing is said.
fn stretches(values: &[f64]) -> Vec<Stretch> {
    let mut sums: Vec<[f64; 2]> = values.iter().map(|v| [*v, v * v]).collect();
    let mut found = Vec::new();
    for length in lengths(values.len()) {
        for (k, [sum, squares]) in sums.iter().enumerate() {
            let tests = [(*squares, length), (sum * sum / length as f64, 1)];
            for (statistic, degrees) in tests.into_iter().filter(|(value, mean)| *value > *mean as f64) {
                let (first, last) = (k * length, (k + 1) * length - 1);
                let tail = chi_squared_tail(statistic, degrees as f64);
                found.push(Stretch { first, last, statistic, degrees, tail });
            }
        }
        sums = sums.chunks_exact(2).map(|pair| [pair[0][0] + pair[1][0], pair[0][1] + pair[1][1]]).collect();
    }
    found
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn white(seed: u64, n: usize) -> Vec<f64> {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut generator)).collect()
    }

    #[test]
    fn the_tests_of_a_series_are_counted_and_share_the_rate() {
        // Of 7: seven single values, three pairs, one stretch of four.
        assert_eq!((n_test(0), n_test(1), n_test(7)), (0, 2, 22));
        let (n, rate) = (500, 0.1);
        let level = rate / n_test(n) as f64;
        let alarms = (0..400).filter(|seed| first_beyond(&white(*seed, n), level).is_some()).count();
        // At most 40 are stated; stretches hold one another, so that fewer happen. Three sd of 40 are 18.
        assert!((8..=58).contains(&alarms), "{alarms} of 400");
    }

    #[test]
    fn a_step_and_a_slow_drift_are_seen_soon_after_they_begin() {
        let level = 0.01 / n_test(1000) as f64;
        for seed in 0..20 {
            let mut step = white(seed, 1000);
            step[600..].iter_mut().for_each(|value| *value += 3.0);
            let seen = first_beyond(&step, level).expect("three sd for 400 values");
            // Eight values of three sd have a sum of 8.5 sd.
            assert!((600..624).contains(&seen.last) && seen.first + 16 > 600, "{seen:?}");
            let mut drift = white(seed, 1000);
            drift[600..].iter_mut().enumerate().for_each(|(k, value)| *value += 0.01 * k as f64);
            let seen = first_beyond(&drift, level).expect("four sd at the end");
            assert!((620..900).contains(&seen.last), "{seen:?}");
        }
    }

    #[test]
    fn innovations_are_those_of_the_joint_normal() {
        // y = J z + e with z standard normal: y has the covariance I + J Jᵀ, whose inverse root whitens in order.
        let jacobian = DMatrix::from_fn(5, 2, |i, j| ((3 * i + j) as f64).sin());
        let value = DVector::from_fn(5, |i, _| (i as f64).cos() + 0.3);
        let joint = DMatrix::identity(5, 5) + &jacobian * jacobian.transpose();
        let root = joint.cholesky().expect("positive definite").l();
        let expected = root.solve_lower_triangular(&value).expect("no zero on the diagonal");
        for z in [DVector::zeros(2), DVector::from_vec(vec![0.4, -1.3])] {
            // The residual at z of the same values.
            let found = innovations(&(&value - &jacobian * &z), &jacobian, &z);
            for (a, b) in found.iter().zip(expected.iter()) {
                // A dozen rounded operations on numbers of about one.
                assert!((a - b).abs() < 1e-12, "{a} for {b}");
            }
        }
    }

    #[test]
    fn what_is_as_expected_is_no_stretch() {
        assert_eq!(strongest(&[]), None);
        assert_eq!(strongest(&[0.1, -0.2, 0.3]), None);
        let far = strongest(&[0.1, 9.0, 0.1]).expect("nine sd");
        assert_eq!((far.first, far.last, far.degrees), (1, 1, 1));
    }
}
