//! Which row it is where sums are not finite.
//!
//! Looked for only then, row by row. Next file to read: [`super`].

use super::{HEIGHT, InferenceError, Stream};

impl Stream {
    /// The first among n steps whose functions are not finite, or at which a sum of their squares or slopes is no longer. (A product of
    /// two is no larger than the larger of their squares.)
    pub(super) fn culprit(&self, n: usize) -> InferenceError {
        let at = |row: usize, what: &str, value| {
            let first = self.row - n as u64 - 1;
            InferenceError::NonFinite { row: first + row as u64, what: what.into(), value }
        };
        let mut squares = vec![0.0; self.columns.ncols()];
        let mut sums = vec![0.0; self.slopes.len()];
        let (mut slopes, mut x) = (sums.clone(), vec![0.0; self.basis.n_channel()]);
        for row in 0..n {
            let values = self.columns.row(row);
            for (name, value) in self.basis.names().iter().zip(values.iter()) {
                if !value.is_finite() {
                    return at(row, name, *value);
                }
            }
            squares.iter_mut().zip(values.iter()).for_each(|(sum, v)| *sum += v * v);
            x.iter_mut().zip(self.mid.chunks_exact(HEIGHT)).for_each(|(x, mid)| *x = mid[row]);
            self.basis.slopes(self.mid_times[row], &x, &mut slopes);
            sums.iter_mut().zip(&slopes).for_each(|(sum, slope)| *sum += slope);
            let lost = |(sum, whole): (&f64, &f64)| !sum.is_finite() && !whole.is_finite();
            if squares.iter().any(|sum: &f64| !sum.is_finite()) || sums.iter().zip(&self.slopes).any(lost) {
                return at(row, OVERFLOW, f64::INFINITY);
            }
        }
        at(0, OVERFLOW, f64::INFINITY)
    }
}

/// What is not finite where every function is.
const OVERFLOW: &str = "the square or a slope of a function";
