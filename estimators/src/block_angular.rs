//! Block-angular matrices: every block of rows holds some of the columns only. Columns of one block alone are its own, the
//! others are shared.
//!
//! The Jacobian of a study with values of its own for every record is one: a record's rows answer to what all records share and
//! to the record's own values. Only those entries are held, and factors are taken block by block (Björck 1996, Numerical Methods
//! for Least Squares Problems, section 6.3; Golub, Plemmons and Sameh 1988). A matrix of one block that holds every column is
//! treated as the dense matrix that it is, bit by bit. Read next: `block_angular/reduction.rs`, which eliminates own columns.

mod reduction;
mod subspace;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

pub(crate) use reduction::Diagonal;
pub(crate) use subspace::Subspace;

/// Part of the length of a step that must lie in the columns of a block for its secant to be changed: with less, rounding and
/// the errors of the runs would determine the slope.
const LEAST_PART: f64 = 1e-4;

/// A matrix of m x p in blocks of rows; entries outside of the blocks are zero. A clone shares the entries.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BlockAngular {
    n_row: usize,
    n_column: usize,
    blocks: Arc<Vec<BlockRow>>,
}

/// Rows of a block-angular matrix and what they hold.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockRow {
    /// The rows; those of the blocks increase.
    pub rows: Range<usize>,
    /// The columns that they hold, increasing.
    pub columns: Vec<usize>,
    /// Their entries, rows x columns.
    pub values: DMatrix<f64>,
}

impl From<DMatrix<f64>> for BlockAngular {
    fn from(values: DMatrix<f64>) -> Self {
        let (n_row, n_column) = values.shape();
        let block = BlockRow { rows: 0..n_row, columns: (0..n_column).collect(), values };
        Self::new(n_row, n_column, vec![block])
    }
}

impl BlockAngular {
    /// A matrix of `n_row` x `n_column` from its blocks.
    pub fn new(n_row: usize, n_column: usize, blocks: Vec<BlockRow>) -> Self {
        Self { n_row, n_column, blocks: Arc::new(blocks) }
    }

    /// A matrix of `n_row` x `n_column` whose blocks hold these rows and columns, entry by entry.
    pub fn from_fn(
        n_row: usize,
        n_column: usize,
        places: impl IntoIterator<Item = (Range<usize>, Vec<usize>)>,
        mut entry: impl FnMut(usize, usize) -> f64,
    ) -> Self {
        let mut block = |(rows, columns): (Range<usize>, Vec<usize>)| {
            let values =
                DMatrix::from_fn(rows.len(), columns.len(), |i, j| entry(rows.start + i, columns[j]));
            BlockRow { rows, columns, values }
        };
        let blocks = places.into_iter().map(&mut block).collect();
        Self::new(n_row, n_column, blocks)
    }

    /// Rows m.
    pub fn nrows(&self) -> usize {
        self.n_row
    }

    /// Columns p.
    pub fn ncols(&self) -> usize {
        self.n_column
    }

    /// The blocks, in the order of their rows.
    pub fn blocks(&self) -> &[BlockRow] {
        &self.blocks
    }

    /// Whether it holds no entry.
    pub fn is_empty(&self) -> bool {
        self.n_entry() == 0
    }

    /// Entries that it holds.
    pub fn n_entry(&self) -> usize {
        self.blocks.iter().map(|block| block.values.len()).sum()
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.blocks.iter().all(|block| block.values.iter().all(|v| v.is_finite()))
    }

    /// The entries where one block holds all of them.
    pub fn dense(&self) -> Option<&DMatrix<f64>> {
        match self.blocks.as_slice() {
            [block] => (block.values.shape() == (self.n_row, self.n_column)).then_some(&block.values),
            _ => None,
        }
    }

    /// As a dense matrix, m x p.
    pub fn to_dense(&self) -> DMatrix<f64> {
        let mut whole = DMatrix::zeros(self.n_row, self.n_column);
        for block in self.blocks.iter() {
            for (column, &j) in block.values.column_iter().zip(&block.columns) {
                whole.view_mut((block.rows.start, j), (block.rows.len(), 1)).copy_from(&column);
            }
        }
        whole
    }

    /// A x, length m, of x of length p.
    pub fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        if let Some(dense) = self.dense() {
            return dense * x;
        }
        let mut product = DVector::zeros(self.n_row);
        for block in self.blocks.iter() {
            let of_block = &block.values * x.select_rows(&block.columns);
            product.rows_mut(block.rows.start, block.rows.len()).copy_from(&of_block);
        }
        product
    }

    /// Aᵀ y, length p, of y of length m.
    pub(crate) fn tr_times(&self, y: &DVector<f64>) -> DVector<f64> {
        if let Some(dense) = self.dense() {
            return dense.tr_mul(y);
        }
        let mut product = DVector::zeros(self.n_column);
        for block in self.blocks.iter() {
            let of_block = block.values.tr_mul(&y.rows(block.rows.start, block.rows.len()));
            for (value, &j) in of_block.iter().zip(&block.columns) {
                product[j] += value;
            }
        }
        product
    }

    /// Squared lengths of the columns, length p.
    pub fn squares(&self) -> DVector<f64> {
        let mut squares = DVector::zeros(self.n_column);
        for block in self.blocks.iter() {
            for (column, &j) in block.values.column_iter().zip(&block.columns) {
                squares[j] += column.norm_squared();
            }
        }
        squares
    }

    /// These rows, increasing, in the same blocks; a block without any is left out unless it is the only one.
    #[must_use]
    pub fn select_rows(&self, at: &[usize]) -> Self {
        let mut blocks = Vec::with_capacity(self.blocks.len());
        for block in self.blocks.iter() {
            let from = at.partition_point(|i| *i < block.rows.start);
            let to = at.partition_point(|i| *i < block.rows.end);
            if from == to && self.blocks.len() > 1 {
                continue;
            }
            let rows: Vec<usize> = at[from..to].iter().map(|i| i - block.rows.start).collect();
            let values = block.values.select_rows(&rows);
            blocks.push(BlockRow { rows: from..to, columns: block.columns.clone(), values });
        }
        Self::new(at.len(), self.n_column, blocks)
    }

    /// A matrix in the same blocks of rows whose column j of `n_column` is column i of this one times a factor, `source` naming
    /// both, or where it names none a column of zeros that every block holds.
    #[must_use]
    pub fn map_columns(&self, n_column: usize, source: impl Fn(usize) -> Option<(usize, f64)>) -> Self {
        let sources: Vec<Option<(usize, f64)>> = (0..n_column).map(source).collect();
        let mapped = |block: &BlockRow| {
            let place = |i: usize| block.columns.binary_search(&i).ok();
            let held = |j: &usize| sources[*j].is_none_or(|(i, _)| place(i).is_some());
            let columns: Vec<usize> = (0..n_column).filter(held).collect();
            let mut values = DMatrix::zeros(block.rows.len(), columns.len());
            for (mut column, &j) in values.column_iter_mut().zip(&columns) {
                if let Some((i, factor)) = sources[j].and_then(|(i, factor)| Some((place(i)?, factor))) {
                    column.copy_from(&(block.values.column(i) * factor));
                }
            }
            BlockRow { rows: block.rows.clone(), columns, values }
        };
        Self::new(self.n_row, n_column, self.blocks.iter().map(mapped).collect())
    }

    /// Sets column `j` to these values (m), in the blocks that hold it.
    pub fn set_column(&mut self, j: usize, values: &DVector<f64>) {
        for block in Arc::make_mut(&mut self.blocks) {
            if let Ok(place) = block.columns.binary_search(&j) {
                let of_block = values.rows(block.rows.start, block.rows.len());
                block.values.column_mut(place).copy_from(&of_block);
            }
        }
    }

    /// Changes the entries of every column of every block, which are those of its rows; `change` gets the first of these as well.
    pub fn for_each_column(&mut self, mut change: impl FnMut(usize, &mut [f64])) {
        for block in Arc::make_mut(&mut self.blocks) {
            for mut column in block.values.column_iter_mut() {
                change(block.rows.start, column.as_mut_slice());
            }
        }
    }

    /// The secant update: changes A so that A x, for a step x (p), comes closer to the observed change; `surprise` (m) is the
    /// observed change minus A x.
    ///
    /// Every row is changed along the part of the step that lies in its columns (Broyden 1965; row by row for a matrix with
    /// zeros, Schubert 1970, Broyden 1971), which keeps the zeros. A block in whose columns almost none of the step lies is not
    /// changed.
    pub(crate) fn learn(&mut self, surprise: &DVector<f64>, step: &DVector<f64>) {
        let whole = step.norm_squared();
        for block in Arc::make_mut(&mut self.blocks) {
            let of_block = step.select_rows(&block.columns);
            let square = of_block.norm_squared();
            if square < LEAST_PART * LEAST_PART * whole {
                continue;
            }
            let square = square.max(f64::MIN_POSITIVE);
            let surprise = surprise.rows(block.rows.start, block.rows.len());
            for (mut column, part) in block.values.column_iter_mut().zip(of_block.iter()) {
                column.zip_apply(&surprise, |value, missed| *value += missed * part / square);
            }
        }
    }

    /// The block that alone holds each column, length p; nothing for a column that several hold, or none.
    fn owners(&self) -> Vec<Option<usize>> {
        let mut holders = vec![(0_usize, 0); self.n_column];
        for (k, block) in self.blocks.iter().enumerate() {
            for &j in &block.columns {
                holders[j] = (holders[j].0 + 1, k);
            }
        }
        holders.into_iter().map(|(n, k)| (n == 1).then_some(k)).collect()
    }
}
