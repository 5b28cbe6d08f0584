//! Predictions and data as whitened deviations from a reference prediction, and their Gram matrix.
//!
//! With q the weights of the reference (sum one), column j is W^{-1/2} (z_j - Z q) and the last column is
//! W^{-1/2} (z - Z q): sensitivities, innovation and residual spread are all combinations of these columns, so one
//! (r+1) x (r+1) Gram matrix holds everything an analysis needs. It is accumulated in blocks of 512 rows that stay in
//! cache. It uses no sigma points. Read next: `gram.rs`, then `information.rs`.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector};
use pulp::Arch;

use crate::gram::{Gram, TILE};
use crate::{Data, EstimatorError, Noise};

/// Rows per block: 24 columns of 512 doubles fit into a second-level cache.
const BLOCK: usize = 512;

/// How the spread of the predictions of one row is measured, for the innovation's variance.
pub(crate) enum Spread<'a> {
    /// Not at all.
    Ignored,
    /// Weighted squares of the deviations.
    Weighted(&'a [f64]),
    /// Squared norm of (deviations) F, r x r.
    Factor(&'a DMatrix<f64>),
}

/// What is to be whitened.
pub(crate) struct Sweep<'a> {
    /// Predictions, m x r.
    pub(crate) predictions: &'a DMatrix<f64>,
    /// Weights q of the reference, length r.
    pub(crate) reference: &'a DVector<f64>,
    /// Particles that count, length r; the columns of the others are zero.
    pub(crate) active: &'a [bool],
    pub(crate) data: &'a Data<'a>,
    /// Observed rows.
    pub(crate) rows: &'a [usize],
    pub(crate) spread: Spread<'a>,
}

/// Whitened columns, their Gram matrix, and the innovation in physical units.
pub(crate) struct Whitened {
    /// The columns themselves, n_used x (r+1), when they were kept.
    pub(crate) columns: Option<DMatrix<f64>>,
    /// Gram matrix, (r+1) x (r+1).
    pub(crate) products: DMatrix<f64>,
    /// log det W of the observed rows.
    pub(crate) log_det_noise: f64,
    /// Observed minus reference, per observed row.
    pub(crate) innovation: Vec<f64>,
    /// Standard deviation of the innovation, per observed row (noise alone when the spread is ignored).
    pub(crate) innovation_sd: Vec<f64>,
}

impl Sweep<'_> {
    /// Whitens; keeps the columns when asked to (dense noise keeps them anyway).
    pub(crate) fn run(&self, keep: bool) -> Result<Whitened, EstimatorError> {
        let mut whitened = match self.data.noise {
            Noise::Diagonal(sd) => self.diagonal(sd, keep),
            Noise::Dense(covariance) => self.dense(covariance)?,
        };
        whitened.products.fill_lower_triangle_with_upper_triangle();
        if whitened.products.iter().all(|v| v.is_finite()) { Ok(whitened) } else { Err(self.culprit()) }
    }

    fn n_column(&self) -> usize {
        self.predictions.ncols() + 1
    }

    fn empty(&self) -> Whitened {
        let (n, c) = (self.rows.len(), self.n_column());
        Whitened {
            columns: None,
            products: DMatrix::zeros(c, c),
            log_det_noise: 0.0,
            innovation: vec![0.0; n],
            innovation_sd: vec![0.0; n],
        }
    }

    fn diagonal(&self, sd: &[f64], keep: bool) -> Whitened {
        let mut out = self.empty();
        let mut columns = keep.then(|| DMatrix::zeros(self.rows.len(), self.n_column()));
        let mut block = Block::new(self.n_column());
        // Rows of one channel share their noise: its logarithm, costly for many rows, is taken once per change.
        let (mut last, mut reciprocal, mut log) = (f64::NAN, f64::NAN, f64::NAN);
        for (b, rows) in self.rows.chunks(BLOCK).enumerate() {
            let first = b * BLOCK;
            for (inverse, &k) in block.inverse_sd.iter_mut().zip(rows) {
                if sd[k].to_bits() != last.to_bits() {
                    (last, reciprocal, log) = (sd[k], 1.0 / sd[k], sd[k].ln());
                }
                *inverse = reciprocal;
                out.log_det_noise += 2.0 * log;
            }
            block.arch.dispatch(|| {
                self.fill(&mut block, rows);
                self.record(&block, first, rows.len(), &mut out);
            });
            block.accumulate(rows.len(), &mut out.products);
            if let Some(columns) = columns.as_mut() {
                columns.rows_mut(first, rows.len()).copy_from(&block.view(rows.len()));
            }
        }
        out.columns = columns;
        out
    }

    fn dense(&self, covariance: &DMatrix<f64>) -> Result<Whitened, EstimatorError> {
        let n = self.rows.len();
        let mut out = self.empty();
        let mut columns = DMatrix::zeros(n, self.n_column());
        let mut block = Block::new(self.n_column());
        for (b, rows) in self.rows.chunks(BLOCK).enumerate() {
            block.inverse_sd.fill(1.0);
            self.fill(&mut block, rows);
            self.record(&block, b * BLOCK, rows.len(), &mut out);
            columns.rows_mut(b * BLOCK, rows.len()).copy_from(&block.view(rows.len()));
        }
        for (s, &k) in out.innovation_sd.iter_mut().zip(self.rows) {
            *s = (*s * *s - 1.0 + covariance[(k, k)]).max(0.0).sqrt();
        }
        let observed = DMatrix::from_fn(n, n, |i, j| covariance[(self.rows[i], self.rows[j])]);
        let root = observed.cholesky().ok_or(EstimatorError::NoiseNotDefinite { n_used: n })?.unpack();
        root.solve_lower_triangular_mut(&mut columns);
        out.log_det_noise = 2.0 * root.diagonal().iter().map(|v| v.ln()).sum::<f64>();
        for first in (0..n).step_by(BLOCK) {
            let rows = BLOCK.min(n - first);
            block.view_mut(rows).copy_from(&columns.rows(first, rows));
            block.accumulate(rows, &mut out.products);
        }
        out.columns = Some(columns);
        Ok(out)
    }

    /// Scaled deviations of one block of rows.
    #[inline(always)]
    fn fill(&self, block: &mut Block, rows: &[usize]) {
        let n = rows.len();
        let r = self.predictions.ncols();
        let contiguous = rows[n - 1] - rows[0] + 1 == n;
        let Block { columns, reference, inverse_sd, .. } = block;
        let (reference, inverse_sd) = (&mut reference[..n], &inverse_sd[..n]);
        reference.fill(0.0);
        for j in (0..r).filter(|&j| self.active[j]) {
            let (q, z) = (self.reference[j], self.predictions.column(j));
            let z = z.as_slice();
            if contiguous {
                let z = &z[rows[0]..=rows[n - 1]];
                reference.iter_mut().zip(z).for_each(|(a, z)| *a += q * z);
            } else {
                reference.iter_mut().zip(rows).for_each(|(a, &k)| *a += q * z[k]);
            }
        }
        for j in 0..=r {
            let mut column = columns.column_mut(j);
            let e = &mut column.as_mut_slice()[..n];
            if j < r && !self.active[j] {
                e.fill(0.0);
                continue;
            }
            let z = if j < r { self.predictions.column(j).data.into_slice() } else { self.data.values };
            if contiguous {
                let z = &z[rows[0]..=rows[n - 1]];
                deviation(e, z, reference, inverse_sd);
            } else {
                for (k, e) in e.iter_mut().enumerate() {
                    *e = (z[rows[k]] - reference[k]) * inverse_sd[k];
                }
            }
        }
    }

    /// Innovation and its standard deviation, back in the unit of each row.
    #[inline(always)]
    fn record(&self, block: &Block, first: usize, n: usize, out: &mut Whitened) {
        let r = self.predictions.ncols();
        let variance = &mut out.innovation_sd[first..first + n];
        variance.fill(1.0);
        match self.spread {
            Spread::Ignored => {}
            Spread::Weighted(weights) => {
                for (j, &w) in weights.iter().enumerate() {
                    let column = block.columns.column(j);
                    let e = &column.data.into_slice()[..n];
                    variance.iter_mut().zip(e).for_each(|(v, e)| *v += w * e * e);
                }
            }
            Spread::Factor(factor) => {
                let spread = block.columns.view((0, 0), (n, r)) * factor;
                for column in spread.column_iter() {
                    variance.iter_mut().zip(&column).for_each(|(v, e)| *v += e * e);
                }
            }
        }
        let innovation = &mut out.innovation[first..first + n];
        for k in 0..n {
            variance[k] = variance[k].sqrt() / block.inverse_sd[k];
            innovation[k] = block.columns[(k, r)] / block.inverse_sd[k];
        }
    }

    /// The first prediction that is not finite.
    fn culprit(&self) -> EstimatorError {
        for particle in (0..self.predictions.ncols()).filter(|&j| self.active[j]) {
            for &row in self.rows {
                let value = self.predictions[(row, particle)];
                if !value.is_finite() {
                    return EstimatorError::NonFinitePrediction { row, particle, value };
                }
            }
        }
        EstimatorError::NotFinite { what: "the square of a whitened prediction" }
    }
}

/// e = (z - a) / sd, one column of a block.
#[inline(always)]
fn deviation(e: &mut [f64], z: &[f64], reference: &[f64], inverse_sd: &[f64]) {
    for (((e, z), a), i) in e.iter_mut().zip(z).zip(reference).zip(inverse_sd) {
        *e = (z - a) * i;
    }
}

/// Buffers of one block, allocated once.
struct Block {
    arch: Arch,
    n_column: usize,
    /// Columns, BLOCK x (r+1), and zeros up to a whole number of tiles.
    columns: DMatrix<f64>,
    reference: Vec<f64>,
    inverse_sd: Vec<f64>,
}

impl Block {
    fn new(n_column: usize) -> Self {
        Self {
            arch: Arch::new(),
            n_column,
            columns: DMatrix::zeros(BLOCK, n_column.next_multiple_of(TILE)),
            reference: vec![0.0; BLOCK],
            inverse_sd: vec![1.0; BLOCK],
        }
    }

    fn view(&self, n: usize) -> DMatrixView<'_, f64> {
        self.columns.view((0, 0), (n, self.n_column))
    }

    fn view_mut(&mut self, n: usize) -> DMatrixViewMut<'_, f64> {
        self.columns.view_mut((0, 0), (n, self.n_column))
    }

    fn accumulate(&mut self, n: usize, products: &mut DMatrix<f64>) {
        self.arch.dispatch(Gram { columns: &mut self.columns, rows: n, products });
    }
}
