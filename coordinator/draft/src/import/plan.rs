//! What a file says, in the terms of a study: the model, its inputs over a period and how the program would run it.
//!
//! Next file to read: [`super::text`].

/// A study before its predictions are known.
#[derive(Debug)]
pub(super) struct Plan {
    /// Name of the study.
    pub(super) name: String,
    /// The program that the file is of.
    pub(super) program: &'static str,
    /// Kind of the model.
    pub(super) kind: &'static str,
    /// Lines of `[model.layout]`.
    pub(super) layout: String,
    /// Parameters with a fixed value.
    pub(super) constants: Vec<(String, f64)>,
    /// Parameters that the study begins with as unknown.
    pub(super) unknowns: Vec<Unknown>,
    /// Outputs that the study begins with as measured, with their units.
    pub(super) channels: Vec<(String, &'static str)>,
    /// The signals that drive the model.
    pub(super) inputs: Inputs,
    /// Times of a period at which the program gives results, both ends included.
    pub(super) points: usize,
    /// How the program runs.
    pub(super) course: Course,
    /// States that the program starts with where it starts from zero, those that are not zero.
    pub(super) initial: Vec<(String, f64)>,
    /// What is left out if it is small.
    pub(super) omissions: Vec<Omission>,
    /// One sentence each, of what was put in another form.
    pub(super) notes: Vec<String>,
}

/// A parameter with a prior around the file's value.
#[derive(Debug)]
pub(super) struct Unknown {
    pub(super) name: String,
    pub(super) unit: &'static str,
    /// The value in the file.
    pub(super) value: f64,
}

/// How the program runs: where it starts, for how many periods, and which of them it shows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Course {
    pub(super) from: Origin,
    /// Periods at most.
    pub(super) cycles: usize,
    /// Whether all periods are shown, or the last one.
    pub(super) all: bool,
    /// A period is the last one where the means of all these outputs are as near as this to those of the one before.
    pub(super) settled: Option<(Vec<String>, f64)>,
}

/// Where a program starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// As the model does by itself.
    Rest,
    /// The steady state under the means of the inputs.
    Steady,
    /// Pressures, flows and volumes of zero, but for the plan's states.
    Zero,
}

/// Something of the file that is left out as long as the model's run says that it is small.
#[derive(Debug)]
pub(super) struct Omission {
    /// Output whose largest value counts.
    pub(super) output: String,
    /// What is left out, as a part of what stays, per unit of that value.
    pub(super) rate: f64,
    /// What it is.
    pub(super) what: String,
    /// Its value, below zero.
    pub(super) value: f64,
    /// Where it stands in the file.
    pub(super) place: String,
}

impl Course {
    /// Periods that the study covers.
    pub(super) fn n_shown(&self) -> usize {
        if self.all { self.cycles } else { 1 }
    }
}

/// Signals on a common grid over one period.
#[derive(Debug)]
pub(super) struct Inputs {
    /// Length of the period in s.
    pub(super) period: f64,
    /// Increasing, from zero to the period.
    pub(super) times: Vec<f64>,
    /// Name, values at the times, mean of the samples in the file.
    pub(super) signals: Vec<Signal>,
}

/// One of them.
#[derive(Debug)]
pub(super) struct Signal {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
    pub(super) mean: f64,
}

/// A course as a file gives it: times from zero to the period, and values.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    pub(super) name: String,
    pub(super) times: Vec<f64>,
    pub(super) values: Vec<f64>,
}

/// Part of a period within which a course that ends elsewhere than it begins comes back.
const RETURN: f64 = 1e-6;

impl Inputs {
    /// Brings courses of one period onto one grid.
    pub(super) fn new(courses: &[Samples], period: f64) -> Self {
        let mut times: Vec<f64> = courses.iter().flat_map(|course| course.times.iter().copied()).collect();
        times.extend([0.0, period]);
        if courses.iter().any(Samples::jumps) {
            times.push(period * (1.0 - RETURN));
        }
        times.sort_by(f64::total_cmp);
        times.dedup_by(|a, b| (*a - *b).abs() <= 1e-12 * period);
        if let Some(last) = times.last_mut() {
            *last = period;
        }
        let signals = courses.iter().map(|course| {
            let mut values: Vec<f64> = times.iter().map(|t| course.at(*t)).collect();
            if let (true, Some(last)) = (course.jumps(), values.last_mut()) {
                *last = course.values[0];
            }
            let mean = course.values.iter().sum::<f64>() / course.values.len() as f64;
            Signal { name: course.name.clone(), values, mean }
        });
        let signals = signals.collect();
        Self { period, times, signals }
    }
}

impl Samples {
    /// Whether it ends elsewhere than it begins.
    pub(super) fn jumps(&self) -> bool {
        let (first, last) = (self.values[0], self.values[self.values.len() - 1]);
        (first - last).abs() > 1e-9 * first.abs().max(last.abs())
    }

    /// Linear between the times, constant beyond them.
    fn at(&self, t: f64) -> f64 {
        let after = self.times.partition_point(|time| *time <= t);
        if after == 0 {
            return self.values[0];
        }
        if after == self.times.len() {
            return self.values[after - 1];
        }
        let part = (t - self.times[after - 1]) / (self.times[after] - self.times[after - 1]);
        (1.0 - part).mul_add(self.values[after - 1], part * self.values[after])
    }

    /// Says what is wrong with its times and values.
    pub(super) fn fault(&self) -> Option<String> {
        let (n, m) = (self.times.len(), self.values.len());
        if n != m {
            return Some(format!("{n} times and {m} values: give as many of one as of the other"));
        }
        if n == 0 {
            return Some("there are no values".to_owned());
        }
        if let Some(at) = self.times.iter().chain(&self.values).position(|v| !v.is_finite()) {
            return Some(format!("number {} is not finite", at % n + 1));
        }
        if n > 1 && self.times[0].abs() > 1e-9 * self.times[n - 1].abs() {
            return Some(format!("the times begin at {} and not at 0", self.times[0]));
        }
        let back = self.times.windows(2).position(|pair| pair[1] <= pair[0])?;
        Some(format!("time {} is not later than the one before it", self.times[back + 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::{Inputs, Samples};

    #[test]
    fn courses_of_different_grids_meet_on_one_and_jumps_return_at_the_end() {
        let course = |name: &str, times: &[f64], values: &[f64]| Samples {
            name: name.to_owned(),
            times: times.to_vec(),
            values: values.to_vec(),
        };
        let a = course("a", &[0.0, 0.5, 1.0], &[0.0, 2.0, 0.0]);
        let b = course("b", &[0.0, 0.25, 1.0], &[1.0, 2.0, 5.0]);
        let inputs = Inputs::new(&[a, b], 1.0);
        assert_eq!(inputs.times, [0.0, 0.25, 0.5, 1.0 - 1e-6, 1.0]);
        let close = |found: &[f64], wanted: [f64; 5]| {
            found.iter().zip(wanted).for_each(|(f, w)| assert!((f - w).abs() < 1e-5, "{found:?}"));
        };
        close(&inputs.signals[0].values, [0.0, 1.0, 2.0, 0.0, 0.0]);
        close(&inputs.signals[1].values, [1.0, 2.0, 3.0, 5.0, 1.0]);
    }

    #[test]
    fn times_that_do_not_increase_from_zero_are_told() {
        let fault = |times: &[f64], n: usize| {
            Samples { name: String::new(), times: times.to_vec(), values: vec![1.0; n] }.fault()
        };
        assert_eq!(fault(&[0.0, 1.0], 2), None);
        assert!(fault(&[0.0, 1.0], 3).unwrap_or_default().contains("2 times and 3 values"));
        assert!(fault(&[0.5, 1.0], 2).unwrap_or_default().contains("begin at 0.5"));
        assert!(fault(&[0.0, 1.0, 1.0], 3).unwrap_or_default().contains("time 1 is not later"));
        assert!(fault(&[0.0, f64::NAN], 2).unwrap_or_default().contains("number 2 is not finite"));
    }
}
