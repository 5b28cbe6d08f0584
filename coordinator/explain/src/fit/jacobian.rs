//! The Jacobian of a fit, split into training rows and all other rows.
//!
//! The rows of a record depend on the values of that record only, hence it is a [`BlockAngular`] matrix. The training rows are
//! shared with the solver of the fit. Next file to read: [`super::drive`].

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{BlockAngular, BlockRow};
use starlings_study::Study;

use crate::rows::Rows;

/// d prediction / d z over the noise, rows × parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct SplitJacobian {
    /// The training rows.
    pub of_train: BlockAngular,
    /// All other rows.
    of_others: BlockAngular,
    /// The rows of each block of the Jacobian of all rows.
    places: Arc<[Range<usize>]>,
}

impl SplitJacobian {
    /// Splits a Jacobian of all rows.
    pub(crate) fn of(whole: &BlockAngular, rows: &Rows) -> Self {
        let others: Vec<usize> = rows.others().collect();
        Self {
            of_train: whole.select_rows(&rows.train),
            of_others: whole.select_rows(&others),
            places: whole.blocks().iter().map(|block| block.rows.clone()).collect(),
        }
    }

    /// The Jacobian whose column j of `n_param` is column i of this one times a factor, `source` naming both; zeros where it
    /// names none.
    #[must_use]
    pub(crate) fn map_columns(&self, n_param: usize, source: impl Fn(usize) -> Option<(usize, f64)>) -> Self {
        Self {
            of_train: self.of_train.map_columns(n_param, &source),
            of_others: self.of_others.map_columns(n_param, &source),
            places: Arc::clone(&self.places),
        }
    }

    /// Sets the column of one parameter, all rows.
    pub(crate) fn set_column(&mut self, j: usize, influence: &DVector<f64>, rows: &Rows) {
        let others: Vec<usize> = rows.others().collect();
        self.of_train.set_column(j, &influence.select_rows(&rows.train));
        self.of_others.set_column(j, &influence.select_rows(&others));
    }

    /// Whether none was measured.
    pub(crate) fn is_empty(&self) -> bool {
        self.of_train.is_empty() && self.of_others.is_empty()
    }

    /// Its size in memory, as a number of series over all rows.
    pub(crate) fn n_series(&self, rows: &Rows) -> usize {
        (self.of_train.n_entry() + self.of_others.n_entry()).div_ceil(rows.rows.len().max(1))
    }

    /// The Jacobian of all rows as a dense matrix; without rows where none was measured.
    pub(crate) fn dense(&self, rows: &Rows) -> DMatrix<f64> {
        self.in_blocks(rows).to_dense()
    }

    /// The Jacobian of all rows; without rows where none was measured.
    pub(crate) fn in_blocks(&self, rows: &Rows) -> BlockAngular {
        if self.is_empty() {
            return BlockAngular::default();
        }
        let others: Vec<usize> = rows.others().collect();
        let parts = [(&self.of_train, &rows.train), (&self.of_others, &others)];
        let mut blocks: Vec<BlockRow> = Vec::with_capacity(self.places.len());
        for place in self.places.iter() {
            let is_here =
                |at: &[usize], part: &Range<usize>| at.get(part.start).is_some_and(|i| place.contains(i));
            let mut of_place: Option<BlockRow> = None;
            for (part, at) in parts {
                for block in part.blocks().iter().filter(|b| !b.rows.is_empty() && is_here(at, &b.rows)) {
                    let whole = of_place.get_or_insert_with(|| BlockRow {
                        rows: place.clone(),
                        columns: block.columns.clone(),
                        values: DMatrix::zeros(place.len(), block.columns.len()),
                    });
                    for (from, i) in at[block.rows.clone()].iter().enumerate() {
                        whole.values.set_row(i - place.start, &block.values.row(from));
                    }
                }
            }
            blocks.extend(of_place);
        }
        BlockAngular::new(rows.rows.len(), self.of_train.ncols(), blocks)
    }
}

/// Blocks of rows with the parameters on which they depend: one block per record, or one for all where no record has values of
/// its own.
///
/// A held-out record is run with the mean of the fitted records' own values, and so depends on all of them; its initial values
/// are those of its own prior.
pub(crate) fn record_blocks(study: &Study, rows: &Rows) -> Vec<(Range<usize>, Vec<usize>)> {
    let n_param = study.theta.len();
    if study.theta.iter().all(|entry| entry.record.is_none()) {
        return vec![(0..rows.rows.len(), (0..n_param).collect())];
    }
    let place = |r: usize| {
        let by_mean = |k: usize| !study.estimates(r, k) && !study.parameters[k].is_initial();
        let answers = |j: &usize| {
            let entry = &study.theta[*j];
            entry.record.is_none_or(|own| own == r) || by_mean(entry.parameter)
        };
        (rows.of_record(r), (0..n_param).filter(answers).collect())
    };
    (0..study.records.len()).map(place).filter(|(of_record, _)| !of_record.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{Row, Usage};

    #[test]
    fn the_parts_make_the_whole_again() {
        let usage = |i: usize| [Usage::HeldOut, Usage::Train, Usage::HeldOutChannel][i % 3];
        let rows = Rows::sample(11, usage);
        let whole = DMatrix::from_fn(11, 2, |i, j| (10 * i + j) as f64);
        let parts = SplitJacobian::of(&whole.clone().into(), &rows);
        assert_eq!(parts.dense(&rows), whole);
        assert_eq!(parts.of_train.to_dense(), whole.select_rows(&rows.train));
        assert!(SplitJacobian::default().is_empty() && SplitJacobian::default().dense(&rows).is_empty());
    }

    #[test]
    fn the_parts_of_a_jacobian_in_blocks_make_it_again() {
        // Three records: one that trains on the first rows, one that trains on none, one that trains on all.
        let usage = |record: usize, step: usize| match record {
            0 if step > 2 => Usage::HeldOut,
            1 => Usage::HeldOut,
            _ => Usage::Train,
        };
        let row = |i: usize| {
            let (record, step) = (i / 5, i % 5);
            let (time, usage) = (step as f64, usage(record, step));
            let (observed, noise, noise_freedom) = (0.0, 1.0, f64::INFINITY);
            Row { record, channel: 0, output: 0, step, time, observed, noise, noise_freedom, usage }
        };
        let rows: Vec<Row> = (0..15).map(row).collect();
        let train = (0..15).filter(|i| rows[*i].usage == Usage::Train).collect();
        let rows = Rows { rows, train, noise: Vec::new() };
        let columns = [vec![0, 1], vec![0, 1, 2], vec![0, 2]];
        let places = columns.into_iter().enumerate().map(|(r, columns)| (rows.of_record(r), columns));
        let whole = BlockAngular::from_fn(15, 3, places, |i, j| (10 * i + j) as f64);
        let mut parts = SplitJacobian::of(&whole, &rows);
        assert_eq!(parts.in_blocks(&rows), whole);
        assert_eq!(parts.of_train.to_dense(), whole.to_dense().select_rows(&rows.train));
        assert_eq!((parts.of_train.n_entry(), parts.n_series(&rows)), (16, 3));
        // The first column doubled, a new one after it.
        let source = |j: usize| [Some((0, 2.0)), None, Some((1, 1.0)), Some((2, 1.0))][j];
        parts = parts.map_columns(4, source);
        let new = DVector::from_fn(15, |i, _| -(i as f64));
        parts.set_column(1, &new, &rows);
        let mut wanted = whole.to_dense().insert_column(1, 0.0);
        wanted.column_mut(0).scale_mut(2.0);
        wanted.set_column(1, &new);
        assert_eq!(parts.dense(&rows), wanted);
    }
}
