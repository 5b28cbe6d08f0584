//! The Jacobian of a fit: what each parameter changes, row by row, with the rows that train apart.
//!
//! A solver holds the rows that train; they are shared with it. Next file to read: [`super::fit`].

use std::sync::Arc;

use nalgebra::DMatrix;

use super::rows::Rows;

/// d prediction / d z over the noise, rows × parameters.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// Those of the rows that train.
    pub of_train: Arc<DMatrix<f64>>,
    /// Those of the others.
    of_others: Arc<DMatrix<f64>>,
}

impl Influences {
    /// Parts a Jacobian of all rows.
    pub fn of(whole: &DMatrix<f64>, rows: &Rows) -> Self {
        let others: Vec<usize> = rows.others().collect();
        Self {
            of_train: Arc::new(whole.select_rows(&rows.train)),
            of_others: Arc::new(whole.select_rows(&others)),
        }
    }

    /// Whether none was measured.
    pub fn is_empty(&self) -> bool {
        self.of_train.is_empty() && self.of_others.is_empty()
    }

    /// The Jacobian of all rows; without rows where none was measured.
    pub fn whole(&self, rows: &Rows) -> DMatrix<f64> {
        if self.is_empty() {
            return DMatrix::zeros(0, 0);
        }
        let mut whole = DMatrix::zeros(rows.rows.len(), self.of_train.ncols());
        let others = rows.others().enumerate();
        for (part, at) in rows.train.iter().enumerate() {
            whole.set_row(*at, &self.of_train.row(part));
        }
        for (part, at) in others {
            whole.set_row(at, &self.of_others.row(part));
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::{Row, Usage};

    #[test]
    fn the_parts_make_the_whole_again() {
        let usage = |i: usize| [Usage::HeldOut, Usage::Train, Usage::HeldOutChannel][i % 3];
        let row = |step: usize| {
            let (time, usage) = (step as f64, usage(step));
            Row { record: 0, channel: 0, output: 0, step, time, observed: 0.0, noise: 1.0, usage }
        };
        let rows: Vec<Row> = (0..11).map(row).collect();
        let train = (0..11).filter(|i| usage(*i) == Usage::Train).collect();
        let rows = Rows { rows, train };
        let whole = DMatrix::from_fn(11, 2, |i, j| (10 * i + j) as f64);
        let parts = Influences::of(&whole, &rows);
        assert_eq!(parts.whole(&rows), whole);
        assert_eq!(*parts.of_train, whole.select_rows(&rows.train));
        assert!(Influences::default().is_empty() && Influences::default().whole(&rows).is_empty());
    }
}
