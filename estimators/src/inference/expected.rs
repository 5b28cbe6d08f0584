//! Sums over the steps of a path that is known with an uncertainty: their mean, by sigma points of every pair of neighbouring states.
//!
//! x_{n+1} is spread by its covariance, and x_n follows it by the smoother's gain with an independent part. Every pair becomes as many
//! steps as there are points, of equal weight, so that functions, slopes and products go the same way as those of a recording. The
//! points are exact up to third moments. Sums at lag one are not made. Read next: `smoother.rs`.

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::Arch;

use super::functions::Samples;
use super::products::{LANES, Products};
use super::smoother::Smoothed;
use super::sums::BlockSums;
use super::{Basis, InferenceError, Sums};

/// Rows of a block.
const ROWS: usize = 512;
/// Length of a column, with room for zeros.
const HEIGHT: usize = ROWS + LANES;

/// Steps of sigma points that were not added up yet.
struct Steps<'a> {
    basis: &'a Basis,
    step: f64,
    n: usize,
    mid_times: Vec<f64>,
    left_times: Vec<f64>,
    mid: Vec<f64>,
    left: Vec<f64>,
    columns: DMatrix<f64>,
    products: DMatrix<f64>,
    slopes: Vec<f64>,
}

/// The mean of the sums over a smoothed path. `rows` gives the inputs, sample after sample.
pub(crate) fn expected_sums(
    basis: &Basis,
    step: f64,
    times: &[f64],
    rows: &[f64],
    path: &[Smoothed],
) -> Result<Sums, InferenceError> {
    let (b, l, width) = (basis.n_function(), basis.n_state(), basis.n_channel());
    let mut steps = Steps {
        basis,
        step,
        n: 0,
        mid_times: vec![0.0; HEIGHT],
        left_times: vec![0.0; HEIGHT],
        mid: vec![0.0; HEIGHT * width],
        left: vec![0.0; HEIGHT * width],
        columns: DMatrix::zeros(HEIGHT, b + l),
        products: DMatrix::zeros(b + l, b + l),
        slopes: vec![0.0; b * l],
    };
    for (k, pair) in path.windows(2).enumerate() {
        let inputs = [&rows[k * width + l..(k + 1) * width], &rows[(k + 1) * width + l..(k + 2) * width]];
        steps.push(times[k], pair, inputs)?;
    }
    steps.flush()?;
    let weight = 1.0 / (4 * l) as f64;
    steps.products *= weight;
    steps.slopes.iter_mut().for_each(|v| *v *= weight);
    let mut sums = Sums::new(basis, step);
    let row = vec![0.0; b + l];
    let n = path.len().saturating_sub(1) as u64;
    sums.add(&BlockSums {
        n,
        products: &steps.products,
        lagged: &DMatrix::zeros(b + l, b + l),
        slopes: &steps.slopes,
        times: [times[0]; 2],
        rows: [&row, &row],
        follows: false,
    });
    Ok(sums.without_pairs())
}

impl Steps<'_> {
    /// The sigma points of one pair of neighbouring states.
    fn push(&mut self, time: f64, pair: &[Smoothed], inputs: [&[f64]; 2]) -> Result<(), InferenceError> {
        let (now, next) = (&pair[0], &pair[1]);
        let n = now.mean.len();
        let (own, later) = (root(&now.rest), root(&next.covariance));
        let follows = &now.gain * &later;
        // Independent directions with a variance of one each: 2 n pairs of points at the root of 2 n.
        let far = (2.0 * n as f64).sqrt();
        let still = DVector::zeros(n);
        for j in 0..2 * n {
            let (before, after) = if j < n {
                (own.column(j).clone_owned(), still.clone())
            } else {
                (follows.column(j - n).clone_owned(), later.column(j - n).clone_owned())
            };
            for side in [far, -far] {
                if self.n == ROWS {
                    self.flush()?;
                }
                self.set(time, &(&now.mean + &before * side), &(&next.mean + &after * side), inputs);
            }
        }
        Ok(())
    }

    fn set(&mut self, time: f64, before: &DVector<f64>, after: &DVector<f64>, inputs: [&[f64]; 2]) {
        let (row, n, b) = (self.n, before.len(), self.basis.n_function());
        (self.left_times[row], self.mid_times[row]) = (time, time + 0.5 * self.step);
        for (l, (before, after)) in before.iter().zip(after).enumerate() {
            self.left[l * HEIGHT + row] = *before;
            self.mid[l * HEIGHT + row] = 0.5 * (before + after);
            self.columns[(row, b + l)] = (after - before) / self.step;
        }
        for (k, (from, to)) in inputs[0].iter().zip(inputs[1]).enumerate() {
            self.left[(n + k) * HEIGHT + row] = *from;
            self.mid[(n + k) * HEIGHT + row] = 0.5 * (from + to);
        }
        self.n += 1;
    }

    fn flush(&mut self) -> Result<(), InferenceError> {
        let (n, l) = (std::mem::take(&mut self.n), self.basis.n_state());
        if n == 0 {
            return Ok(());
        }
        let samples = |times, channels| Samples { n, times, channels, height: HEIGHT, n_state: l };
        let (mid, left) = (samples(&self.mid_times, &self.mid), samples(&self.left_times, &self.left));
        let columns = self.columns.as_mut_slice();
        let functions = &mut columns[..self.basis.n_function() * HEIGHT];
        self.basis.evaluate(&mid, &left, functions, HEIGHT, &mut self.slopes);
        columns.chunks_exact_mut(HEIGHT).for_each(|column| column[n..].fill(0.0));
        let products = Products { columns, height: HEIGHT, rows: n, lag: 0, sums: &mut self.products };
        Arch::new().dispatch(products);
        if self.products.iter().chain(&self.slopes).all(|v| v.is_finite()) {
            return Ok(());
        }
        Err(InferenceError::Overflow { what: "a function on the smoothed path" })
    }
}

/// A factor of a covariance that may be singular to rounding.
pub(crate) fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let lift = 1e-13 * covariance.diagonal().amax() + f64::MIN_POSITIVE;
    let lifted = covariance + DMatrix::identity(n, n) * lift;
    lifted.cholesky().map_or_else(|| DMatrix::zeros(n, n), Cholesky::unpack)
}
