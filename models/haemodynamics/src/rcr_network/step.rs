//! The exact step of a linear network over a span on which its signals are linear.
//!
//! dx/dt = A x + c₀ + c₁ τ is solved by the exponential of the augmented matrix (Van Loan 1978), computed by scaling and
//! squaring (Higham 2005). Next file to read: [`super::shift`].

use nalgebra::{DMatrix, DVector};
use starlings_models_core::exponential::exponential;

use super::solve::{Given, Network};

/// A span on which signals are linear.
#[derive(Clone, Copy)]
pub(super) struct Span<'a> {
    pub(super) length: f64,
    /// Signals at its start.
    pub(super) start: &'a [f64],
    /// Signals at its end.
    pub(super) end: &'a [f64],
    /// Their slopes.
    pub(super) slopes: &'a [f64],
}

/// Advances the state of a linear network; to NaN where an element is faster than the step by more than numbers can hold.
pub(super) fn exact(network: &Network, theta: &[f64], span: Span<'_>, x: &mut [f64]) {
    let n = x.len();
    if n == 0 {
        return;
    }
    let h = span.length;
    let zero = vec![0.0; n];
    let at = |signals| {
        let mut rate = vec![0.0; n];
        network.rate(Given { x: &zero, theta, signals, slopes: span.slopes }, &mut rate);
        rate
    };
    let (first, last) = (at(span.start), at(span.end));
    // Scaled time τ/h; the constant and the linear part of the rate, times h, are scaled to entries of at most one.
    let size = first.iter().chain(&last).fold(0.0, |size: f64, f| size.max((f * h).abs()));
    let scale = if size > 0.0 { size } else { 1.0 };
    let mut augmented = DMatrix::zeros(n + 2, n + 2);
    augmented.view_mut((0, 0), (n, n)).copy_from(&(matrix(network, theta, n) * h));
    for i in 0..n {
        augmented[(i, n)] = h * (last[i] - first[i]) / scale;
        augmented[(i, n + 1)] = h * first[i] / scale;
    }
    augmented[(n, n + 1)] = 1.0;
    let mut start = DVector::zeros(n + 2);
    start.rows_mut(0, n).copy_from_slice(x);
    start[n + 1] = scale;
    let end = exponential(&augmented) * start;
    x.copy_from_slice(&end.as_slice()[..n]);
}

/// A: the rates for unit states without sources.
fn matrix(network: &Network, theta: &[f64], n: usize) -> DMatrix<f64> {
    let mut quiet = theta.to_vec();
    for branch in &network.circuit.resistive {
        branch.against.into_iter().for_each(|at| quiet[at] = 0.0);
    }
    network.circuit.constant_levels().for_each(|at| quiet[at] = 0.0);
    let silent = vec![0.0; network.circuit.n_signal];
    let mut matrix = DMatrix::zeros(n, n);
    let mut unit = vec![0.0; n];
    for (j, mut column) in matrix.column_iter_mut().enumerate() {
        unit[j] = 1.0;
        let given = Given { x: &unit, theta: &quiet, signals: &silent, slopes: &silent };
        network.rate(given, column.as_mut_slice());
        unit[j] = 0.0;
    }
    matrix
}
