//! Courses of boundary conditions: samples of a period, a number, or an expression.
//!
//! Next file to read: [`super::formula`].

use super::super::plan::Samples;
use super::blocks::Blocks;
use super::file::Given;
use super::formula::Formula;

impl Blocks {
    /// Adds what drives a source, whose values have this key.
    pub(super) fn signal(
        &mut self,
        place: &str,
        key: &str,
        name: String,
        given: Given,
    ) -> Result<(), String> {
        match given {
            Given { t, values: Some(values), function: None } => {
                let times = t.unwrap_or_else(|| if values.len() == 1 { vec![0.0] } else { Vec::new() });
                self.course(place, name, times, values)
            }
            Given { t: None, values: None, function: Some(text) } => {
                let place = format!("{place}.fn");
                let formula = Formula::new(&text).map_err(|fault| format!("{place}: {fault}"))?;
                self.formulas.push((name, formula, place));
                Ok(())
            }
            Given { function: Some(_), .. } => {
                Err(format!("{place}.fn: stands in place of `{key}` and `t`, not beside them"))
            }
            Given { .. } => Err(format!("{place}: missing field `{key}`")),
        }
    }

    /// Adds the course of an input.
    pub(super) fn course(
        &mut self,
        place: &str,
        name: String,
        times: Vec<f64>,
        values: Vec<f64>,
    ) -> Result<(), String> {
        let course = from_zero(Samples { name, times, values });
        if let Some(fault) = course.fault() {
            return Err(format!("{place}: {fault}"));
        }
        self.courses.push(course);
        Ok(())
    }

    /// Adds the courses of the expressions, whose period is known now.
    pub(super) fn sample_formulas(&mut self, period: f64) -> Result<(), String> {
        for (name, formula, place) in &self.formulas {
            let samples = formula.samples(name, period).map_err(|fault| format!("{place}: {fault}"))?;
            self.courses.push(samples);
        }
        Ok(())
    }
}

/// The same from zero to its length, as the program reads times that begin later: what is before the first lies on the line through the
/// first two. Where that does not meet the end of the period, the course jumps there.
fn from_zero(course: Samples) -> Samples {
    let n = course.times.len();
    let increases = course.times.windows(2).all(|pair| pair[1] > pair[0]);
    if n < 2 || n != course.values.len() || !increases || course.times[0] < 0.0 || course.fault().is_none() {
        return course;
    }
    let period = course.times[n - 1] - course.times[0];
    let at = |t: f64| {
        let k = course.times.partition_point(|time| *time < t).clamp(1, n - 1);
        let part = (t - course.times[k - 1]) / (course.times[k] - course.times[k - 1]);
        (1.0 - part).mul_add(course.values[k - 1], part * course.values[k])
    };
    let inside = course.times.iter().copied().filter(|t| *t > 0.0 && *t < period);
    let times: Vec<f64> = std::iter::once(0.0).chain(inside).chain([period]).collect();
    let values: Vec<f64> = times.iter().map(|t| at(*t)).collect();
    Samples { name: course.name, times, values }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_begin_elsewhere_are_read_within_a_period_from_zero() {
        let course = |times: &[f64], values: &[f64]| {
            from_zero(Samples { name: String::new(), times: times.to_vec(), values: values.to_vec() })
        };
        let late = course(&[0.5, 1.0, 3.0], &[1.0, 2.0, -2.0]);
        assert_eq!((late.times, late.values), (vec![0.0, 0.5, 1.0, 2.5], vec![0.0, 1.0, 2.0, -1.0]));
        // Half a period of two samples, which jumps at its end.
        let coarse = course(&[0.5, 1.0, 1.5], &[0.0, 1.0, 0.0]);
        assert_eq!((coarse.times, coarse.values), (vec![0.0, 0.5, 1.0], vec![-1.0, 0.0, 1.0]));
        assert!(course(&[-1.0, 0.0, 1.0], &[3.0, 0.0, 1.0]).fault().is_some(), "nothing is read before zero");
        let good = course(&[0.0, 1.0], &[1.0, 1.0]);
        assert_eq!(good.times, [0.0, 1.0]);
        assert!(course(&[0.5, 0.5], &[1.0, 1.0]).fault().is_some());
    }
}
