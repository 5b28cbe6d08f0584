//! Sums as a list of numbers, for a way between machines that carries numbers bit by bit.
//!
//! The list holds the counts, what stands in the matrices (of a symmetric one its upper triangle) and the ends. Which functions they
//! belong to is not in it: both sides make the same basis, and its names are compared elsewhere. Next file to read: [`super`].

use nalgebra::DMatrix;

use super::{End, MOST, Sums};
use crate::inference::{Basis, InferenceError};

impl Sums {
    /// Numbers that sums over a basis are written as.
    pub fn n_value(basis: &Basis) -> usize {
        let (b, l) = (basis.n_function(), basis.n_state());
        let width = b + l;
        3 + width * (width + 1) / 2 + width * width + b * l + 2 * (1 + width)
    }

    /// These sums as numbers, [`Sums::n_value`] of them, all finite.
    pub fn to_values(&self) -> Vec<f64> {
        let width = self.n_function + self.n_state;
        let ends = self.first.as_ref().zip(self.last.as_ref());
        let mut values = vec![self.n_step as f64, self.n_pair as f64, f64::from(u8::from(ends.is_some()))];
        values.extend((0..width).flat_map(|j| (0..=j).map(move |i| (i, j))).map(|at| self.products[at]));
        values.extend(self.lagged.iter().chain(&self.slopes));
        match ends {
            Some((first, last)) => {
                for end in [first, last] {
                    values.push(end.time);
                    values.extend(&end.row);
                }
            }
            None => values.resize(values.len() + 2 * (1 + width), 0.0),
        }
        values
    }

    /// Sums over a basis, for steps of length `step`, from numbers that came from elsewhere.
    ///
    /// # Errors
    /// `Shape` for another number of them; as for [`Sums::check`].
    pub fn from_values(basis: &Basis, step: f64, values: &[f64]) -> Result<Self, InferenceError> {
        let (expected, got) = (Self::n_value(basis), values.len());
        if expected != got {
            return Err(InferenceError::Shape { what: "numbers of block sums", expected, got });
        }
        let (b, l, width) = (basis.n_function(), basis.n_state(), basis.n_function() + basis.n_state());
        let count = |value: f64| {
            let whole = value >= 0.0 && value <= MOST as f64 && value.fract().abs() <= 0.0;
            if whole { Ok(value as u64) } else { Err(InferenceError::Damaged { what: "a count of steps" }) }
        };
        let mut rest = &values[3..];
        let mut take = |n: usize| {
            let (these, after) = rest.split_at(n);
            rest = after;
            these
        };
        let mut products = DMatrix::zeros(width, width);
        let mut upper = take(width * (width + 1) / 2).iter();
        for j in 0..width {
            for (i, value) in (0..=j).zip(&mut upper) {
                products[(i, j)] = *value;
            }
        }
        let lagged = DMatrix::from_column_slice(width, width, take(width * width));
        let slopes = DMatrix::from_column_slice(l, b, take(b * l));
        let has_ends = count(values[2])? > 0;
        let mut end = || {
            let (time, row) = (take(1)[0], take(width).to_vec());
            has_ends.then_some(End { time, row })
        };
        let (first, last) = (end(), end());
        let (n_step, n_pair) = (count(values[0])?, count(values[1])?);
        let sums = Self { n_step, n_pair, products, lagged, slopes, first, last, ..Self::new(basis, step) };
        sums.check(basis)?;
        Ok(sums)
    }
}
