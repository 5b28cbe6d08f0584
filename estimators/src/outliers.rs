//! Single values of a recording that stand apart from all around them, as a sensor's dropouts and spikes do.
//!
//! A state of a system has a course, so a value that is far from what its neighbours on both sides say, where these agree with each other and with
//! theirs, is the sensor's. What is far is measured by how far the values of the record are from what theirs say: the median of that, which
//! outliers do not move (the identifier of Hampel 1974, The influence curve and its role in robust estimation, here of the
//! differences from neighbours, so that a course does not count as scatter). An edge, a peak or a pulse of several samples is no outlier: without its
//! value the neighbours do not agree. Next file to read: [`crate::diagnostics`], for the noise of a series.

use crate::diagnostics::{MEDIAN_ABSOLUTE, median};

/// Distance, in standard deviations of the record's distances, beyond which a value may be an outlier.
const FAR: f64 = 8.0;

/// Times that it is as far away as any neighbour is from the course without it.
const ALONE: f64 = 4.0;

/// Values of a record without which nothing is said.
const FEWEST: usize = 20;

/// Of the values of a series one in so many may be a fault; where more stand apart, that is how the signal or its noise is.
const ONE_IN: usize = 50;

/// Standard deviation of a value's distance from the middle of its neighbours, for independent errors of standard deviation 1.
const OF_NOISE: f64 = 1.224_744_871_391_589;

/// A value that stands apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Its place in the series.
    pub at: usize,
    /// How far it is from the line through its neighbours, in the unit of the values.
    pub distance: f64,
    /// The same over the standard deviation of such distances.
    pub times: f64,
}

/// The outliers of values at these times, in their order; missing values are NaN. `noise` is the standard deviation of the sensor's noise where it
/// is known, which the scatter is not taken to be below.
///
/// The first two and the last two values are none, beside which a step that comes at once looks the same; nor is any among fewer than twenty.
pub fn outliers(times: &[f64], values: &[f64], noise: Option<f64>) -> Vec<Outlier> {
    let Some(course) = Course::of(times, values, noise) else { return Vec::new() };
    let n = course.known.len();
    // What the two neighbours on either side are from their course without it, as far as there are any.
    let beside = |i: usize| {
        let before =
            [(2, i - 1, i + 1), (3, i - 2, i - 1)].map(|(back, k, b)| (k, i.checked_sub(back), Some(b)));
        let after = [(2, i + 1, i - 1), (3, i + 2, i + 1)].map(|(on, k, a)| (k, Some(a), Some(i + on)));
        let of = before.into_iter().chain(after).filter_map(|(k, a, b)| Some((k, a?, b.filter(|b| *b < n)?)));
        of.map(|(k, a, b)| course.off_line(k, a, b).abs()).fold(0.0, f64::max)
    };
    let is_alone = |i: &usize| course.distance(*i) > ALONE * beside(*i);
    let found = (2..n - 2).filter(|i| course.is_far(*i)).filter(is_alone);
    found.map(|i| course.outlier(i, course.distance(i))).collect()
}

/// The first and the last value, where they stand apart from the course of those beside them, as these do not: by a fault, or since the signal
/// changed within one sample. Times and noise as in [`outliers`]; the distance is that from the line through the two next values.
pub fn ends_apart(times: &[f64], values: &[f64], noise: Option<f64>) -> [Option<Outlier>; 2] {
    let Some(course) = Course::of(times, values, noise) else { return [None; 2] };
    let last = course.known.len() - 1;
    // An end is as far from the line through the next two as the one beside it from the line through the end, but for the spacing.
    let apart = |end: usize, [next, second, third]: [usize; 3]| {
        let of_others = course.distance(second).max(course.distance(third));
        (course.is_far(next) && course.distance(next) > ALONE * of_others).then(|| {
            let distance = course.off_line(end, next, second).abs();
            Outlier { times: course.distance(next) / course.scatter, ..course.outlier(end, distance) }
        })
    };
    [apart(0, [1, 2, 3]), apart(last, [1, 2, 3].map(|k| last - k))]
}

/// A series as the distances of its values from the lines through their neighbours.
struct Course<'a> {
    times: &'a [f64],
    values: &'a [f64],
    /// Places of the values that are not missing.
    known: Vec<usize>,
    /// Of each of them but the ends.
    distances: Vec<f64>,
    /// Standard deviation of the distances.
    scatter: f64,
}

impl<'a> Course<'a> {
    /// `None` where there are too few values.
    fn of(times: &'a [f64], values: &'a [f64], noise: Option<f64>) -> Option<Self> {
        let known: Vec<usize> = (0..values.len()).filter(|at| values[*at].is_finite()).collect();
        let n = known.len();
        if n < FEWEST {
            return None;
        }
        let mut course = Self { times, values, known, distances: Vec::new(), scatter: 0.0 };
        course.distances = (1..n - 1).map(|i| course.off_line(i, i - 1, i + 1).abs()).collect();
        course.scatter = (median(course.distances.iter().copied()) / MEDIAN_ABSOLUTE)
            .max(OF_NOISE * noise.unwrap_or(0.0))
            .max(step(values, &course.known));
        Some(course)
    }

    /// The distance of value i from the line through values a and b.
    fn off_line(&self, i: usize, a: usize, b: usize) -> f64 {
        let (times, values) = (self.times, self.values);
        let [i, a, b] = [i, a, b].map(|k| self.known[k]);
        let part = (times[i] - times[a]) / (times[b] - times[a]);
        values[i] - (values[a] + (values[b] - values[a]) * part)
    }

    /// The distance of a value that is no end.
    fn distance(&self, i: usize) -> f64 {
        self.distances[i - 1]
    }

    fn is_far(&self, i: usize) -> bool {
        self.distance(i) > FAR * self.scatter
    }

    fn outlier(&self, i: usize, distance: f64) -> Outlier {
        Outlier { at: self.known[i], distance, times: distance / self.scatter }
    }
}

/// Whether so many outliers of a series are too many to be faults of single values: the signal has pulses then, or its noise heavy tails.
pub fn are_too_many(outliers: &[Outlier], values: &[f64]) -> bool {
    let n = values.iter().filter(|value| value.is_finite()).count();
    outliers.len() > (n / ONE_IN).max(1)
}

/// The step of values that were rounded: the smallest difference of neighbours that is none of rounding numbers.
fn step(values: &[f64], known: &[usize]) -> f64 {
    let size = known.iter().fold(0.0_f64, |size, at| size.max(values[*at].abs()));
    let steps = known.windows(2).map(|pair| (values[pair[1]] - values[pair[0]]).abs());
    let least = steps.filter(|step| *step > 1e-12 * size).fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal, StudentT};

    use super::*;

    fn times(n: usize) -> Vec<f64> {
        (0..n).map(|k| 0.1 * k as f64).collect()
    }

    fn noisy(course: impl Fn(f64) -> f64, seed: u64) -> Vec<f64> {
        let (mut rng, noise) = (ChaCha8Rng::seed_from_u64(seed), Normal::new(0.0, 0.05).expect("an sd"));
        times(300).into_iter().map(|t| course(t) + noise.sample(&mut rng)).collect()
    }

    fn found(values: &[f64]) -> Vec<usize> {
        outliers(&times(values.len()), values, None).into_iter().map(|outlier| outlier.at).collect()
    }

    #[test]
    fn spikes_of_twenty_sd_and_more_are_found_on_any_course() {
        let courses: [fn(f64) -> f64; 4] = [
            |t| 3.0 * t.sin(),
            |t| f64::from(u8::from(t.sin() > 0.0)),
            |t| 2.0 * (2.0 * t).sin().abs(),
            |_| 0.0,
        ];
        for (seed, course) in courses.into_iter().enumerate() {
            let clean = noisy(course, seed as u64);
            assert_eq!(found(&clean), [0; 0], "course {seed}");
            let mut values = clean.clone();
            values[40] += 1.0;
            values[171] -= 5.0;
            assert_eq!(found(&values), [40, 171], "course {seed}");
            let mut near = clean.clone();
            (near[2], near[297]) = (near[2] - 5.0, near[297] + 5.0);
            assert_eq!(found(&near), [2, 297], "course {seed}");
            // A missing value beside it changes nothing.
            values[41] = f64::NAN;
            assert_eq!(found(&values), [40, 171], "course {seed}");
        }
        let one = outliers(
            &times(300),
            &{
                let mut v = noisy(|_| 0.0, 9);
                v[100] += 5.0;
                v
            },
            None,
        )[0];
        assert!((one.distance - 5.0).abs() < 0.3, "{one:?}");
        // Noise of 0.05 leaves distances of 0.061.
        assert!((one.times - 5.0 / 0.0612).abs() < 20.0, "{one:?}");
    }

    #[test]
    fn an_end_that_stands_apart_is_told_and_one_beside_it_that_does_is_not_taken_for_it() {
        let at = |values: &[f64]| {
            ends_apart(&times(values.len()), values, None).map(|end| end.map(|outlier| outlier.at))
        };
        let clean = noisy(|t| 3.0 * t.sin(), 7);
        assert_eq!(at(&clean), [None, None]);
        let mut values = clean.clone();
        (values[0], values[299]) = (values[0] + 2.0, values[299] - 2.0);
        assert_eq!(at(&values), [Some(0), Some(299)]);
        let [Some(first), _] = ends_apart(&times(300), &values, None) else { panic!("it is told") };
        assert!((first.distance - 2.0).abs() < 0.4 && first.times > 10.0, "{first:?}");
        assert_eq!(found(&values), [0; 0], "it is told and no more");
        // What is missing before the first value and after the last one changes nothing.
        (values[0], values[299]) = (f64::NAN, f64::NAN);
        assert_eq!(at(&values), [None, None]);
        (values[1], values[298]) = (values[1] + 2.0, values[298] - 2.0);
        assert_eq!(at(&values), [Some(1), Some(298)]);
        let mut beside = clean;
        (beside[1], beside[298]) = (beside[1] + 2.0, beside[298] - 2.0);
        assert_eq!(at(&beside), [None, None]);
    }

    #[test]
    fn what_a_system_does_is_no_outlier() {
        let smooth = |course: &dyn Fn(f64) -> f64| times(300).into_iter().map(course).collect::<Vec<f64>>();
        // An edge, a peak, a kink, a fall after a jump, two samples far off, a signal that is on once: all without noise.
        assert_eq!(found(&smooth(&|t| f64::from(u8::from(t > 14.95)))), [0; 0]);
        assert_eq!(found(&smooth(&|t| (-(t - 15.0) * (t - 15.0) / 0.02).exp() + 1e-3 * t.sin())), [0; 0]);
        assert_eq!(found(&smooth(&|t| (t - 15.0).abs() + 1e-3 * t.sin())), [0; 0]);
        assert_eq!(found(&smooth(&|t| if t < 14.95 { 0.0 } else { (-(t - 15.0) / 0.1).exp() })), [0; 0]);
        let mut two = noisy(f64::sin, 3);
        (two[100], two[101]) = (two[100] + 3.0, two[101] + 3.0);
        assert_eq!(found(&two), [0; 0]);
        assert_eq!(found(&smooth(&|t| f64::from(u8::from((t - 15.0).abs() < 0.05)))), [0; 0]);
    }

    #[test]
    fn the_scatter_is_no_less_than_the_stated_noise_and_the_step_of_rounded_values() {
        let mut values = noisy(f64::sin, 5);
        values[100] += 1.0;
        assert_eq!(outliers(&times(300), &values, Some(0.2)), []);
        assert_eq!(outliers(&times(300), &values, Some(0.05)).len(), 1);
        let rounded: Vec<f64> = values.iter().map(|v| v.round()).collect();
        assert_eq!(found(&rounded), [0; 0]);
        let (few, at) = (&values[91..110], 9);
        assert!((few[at] - values[100]).abs() < 1e-15 && found(few).is_empty(), "nineteen values");
    }

    #[test]
    fn heavy_tails_lose_a_value_in_a_thousand_at_most() {
        let (mut rng, tails) = (ChaCha8Rng::seed_from_u64(1), StudentT::new(5.0).expect("degrees"));
        let values: Vec<f64> = (0..100_000).map(|_| tails.sample(&mut rng)).collect();
        assert!(found(&values).len() < 100, "{}", found(&values).len());
    }
}
