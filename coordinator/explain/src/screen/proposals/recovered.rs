//! The unknown input of an equation as data, and how well a term predicts it.
//!
//! The fitted parameters have taken up part of what is missing: what each of them changes in the rate, for which a constant and every
//! state and input in proportion stand as well, since they act through other equations too. A
//! term counts by what it predicts of parts that its fit has not seen (Stone 1974, J. R. Statist. Soc. B 36, 111). Next file to read:
//! [`super::grammar`].

use nalgebra::{DMatrix, DVector};

use super::taken_up::slopes;
use crate::locate::UnknownInput;
use crate::screen::along_run::ReferenceRun;

/// Parts of the record, each of which is predicted from the others.
const PARTS: usize = 5;
/// Added to the products of columns of length one: some of them repeat one another.
const RIDGE: f64 = 1e-9;

/// An unknown input over its standard deviations, with what the parameters may have taken up.
pub(super) struct Recovered {
    weight: DVector<f64>,
    value: DVector<f64>,
    /// Values × (1 + signals + parameters), weighted, columns of length one.
    taken_up: DMatrix<f64>,
}

impl Recovered {
    /// `None` for an input of too few values, or one whose record or course is not known.
    pub(super) fn new(run: &ReferenceRun<'_>, input: &UnknownInput) -> Option<Self> {
        let record = run.study.records.iter().position(|r| r.name == input.record)?;
        let steps = super::steps(&run.study.records[record].times, &input.time);
        let n = input.value.len();
        let smallest = input.sd.iter().copied().filter(|sd| *sd > 0.0).fold(f64::INFINITY, f64::min);
        let is_sound = input.value.iter().chain(&input.sd).all(|v| v.is_finite()) && smallest.is_finite();
        let spec = &run.study.spec;
        let signals: Vec<&Vec<f64>> = run
            .tracks
            .iter()
            .filter(|t| spec.states.iter().chain(&spec.inputs).any(|q| q.name == t.name && q.size == 1))
            .filter_map(|t| t.values.get(record))
            .collect();
        let slopes = slopes(run, &input.state, record, &steps);
        let p = signals.len() + 1 + slopes.len();
        if !is_sound || n < PARTS * (p + 2) {
            return None;
        }
        let weight = DVector::from_fn(n, |i, _| 1.0 / input.sd[i].max(smallest));
        let of = |i: usize, j: usize| match j.checked_sub(1 + signals.len()) {
            Some(k) => slopes[k][i],
            None if j == 0 => 1.0,
            None => signals[j - 1].get(steps[i]).copied().unwrap_or(f64::NAN),
        };
        let mut taken_up = DMatrix::from_fn(n, p, |i, j| weight[i] * of(i, j));
        if taken_up.iter().any(|v| !v.is_finite()) {
            return None;
        }
        for mut column in taken_up.column_iter_mut() {
            let size = column.norm();
            column /= if size > 0.0 { size } else { 1.0 };
        }
        let value = DVector::from_fn(n, |i, _| weight[i] * input.value[i]);
        Some(Self { weight, value, taken_up })
    }

    /// The share of the input, beyond what the parameters may have taken up, that a term with these values predicts from part to part.
    /// `None` where it predicts nothing, or with another sign in another part.
    pub(super) fn predicted_by(&self, term: &[f64]) -> Option<f64> {
        let n = self.value.len();
        let column = DVector::from_fn(n, |i, _| self.weight[i] * term.get(i).copied().unwrap_or(f64::NAN));
        let size = column.norm();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let p = self.taken_up.ncols();
        let mut with = self.taken_up.clone().resize_horizontally(p + 1, 0.0);
        with.set_column(p, &(column / size));
        let (mut without_error, mut with_error, mut sign) = (0.0, 0.0, 0.0);
        for part in 0..PARTS {
            let unseen = part * n / PARTS..(part + 1) * n / PARTS;
            let (error, _) = self.unseen_error(&self.taken_up, &unseen)?;
            let (error_with, coefficient) = self.unseen_error(&with, &unseen)?;
            without_error += error;
            with_error += error_with;
            if sign * coefficient < 0.0 {
                return None;
            }
            sign = coefficient;
        }
        (with_error < without_error).then(|| 1.0 - with_error / without_error)
    }

    /// Square error of a part by a fit of these columns to the others, and the last coefficient of that fit.
    fn unseen_error(&self, columns: &DMatrix<f64>, unseen: &std::ops::Range<usize>) -> Option<(f64, f64)> {
        let seen: Vec<usize> = (0..self.value.len()).filter(|i| !unseen.contains(i)).collect();
        let (a, b) = (columns.select_rows(&seen), self.value.select_rows(&seen));
        let products = a.tr_mul(&a) + DMatrix::identity(a.ncols(), a.ncols()) * RIDGE;
        let fitted = products.cholesky()?.solve(&a.tr_mul(&b));
        let (from, n) = (unseen.start, unseen.len());
        let error = self.value.rows(from, n) - columns.rows(from, n) * &fitted;
        Some((error.norm_squared(), fitted[fitted.len() - 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a signal, a constant and the signal itself being what the parameters take up.
    fn recovered(of: impl Fn(f64) -> f64) -> (Recovered, Vec<f64>) {
        let signal: Vec<f64> = (0..100).map(|k| (0.37 * f64::from(k)).sin()).collect();
        let taken_up =
            DMatrix::from_fn(100, 2, |i, j| if j == 0 { 0.1 } else { signal[i] / 50.0_f64.sqrt() });
        let value = DVector::from_iterator(100, signal.iter().map(|s| of(*s)));
        (Recovered { weight: DVector::from_element(100, 1.0), value, taken_up }, signal)
    }

    #[test]
    fn the_term_of_the_right_form_predicts_what_others_do_not() {
        let (input, signal) = recovered(|s| 0.3 - 2.0 * s + 1.5 * s.powi(3));
        let share =
            |of: fn(f64) -> f64| input.predicted_by(&signal.iter().map(|s| of(*s)).collect::<Vec<_>>());
        // Exact up to rounding and the ridge of 1e-9.
        assert!(share(|s| s.powi(3)).is_some_and(|share| share > 0.999_999), "{:?}", share(|s| s.powi(3)));
        assert!(share(|s| s * s).is_none_or(|share| share < 0.1), "an even function");
        assert!(share(|s| 4.0 * s).is_none_or(|share| share < 1e-6), "the parameters have it");
        assert_eq!(share(|_| f64::NAN), None);
    }
}
