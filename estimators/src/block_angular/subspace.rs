//! The range of a block-angular matrix over its prior's rows: an orthonormal basis in the same blocks, and the covariance.
//!
//! Of A over diag(d) every block's own columns are factored within its rows and their prior's; what is left of the rows is stacked
//! and factored for the shared columns, whose basis is then spread over the blocks (Björck 1996, section 6.3). Vectors have the m
//! rows of A, then the p of the prior. Read next: `score.rs`, which asks what lies outside of the range.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::{BlockAngular, BlockRow};
use crate::error::EstimatorError;
use crate::qr;

/// An orthonormal basis of the range, and the inverse of the triangle that goes with it.
#[derive(Debug, Clone)]
pub(crate) struct Subspace {
    n_row: usize,
    blocks: Vec<Part>,
    shared: Vec<usize>,
    /// The prior's rows of the shared columns, s x s.
    of_prior: DMatrix<f64>,
    /// (AᵀA + diag(d)²) inverse, p x p.
    covariance: DMatrix<f64>,
}

/// The rows of the basis that belong to a block: its own, then the prior's of its own columns.
#[derive(Debug, Clone)]
struct Part {
    rows: Range<usize>,
    own: Vec<usize>,
    /// Columns of the block's own range, then those of the shared: (m + q) x (q + s).
    basis: DMatrix<f64>,
}

/// A block whose own columns were factored.
struct Factored {
    own: Vec<usize>,
    /// Places of the block's other columns among the shared.
    places: Vec<usize>,
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl Subspace {
    /// The range of A (m x p) over diag(d), d of length p.
    ///
    /// # Errors
    /// `NotPositiveDefinite` when they leave a direction free.
    pub(crate) fn new(a: &BlockAngular, d: &DVector<f64>) -> Result<Self, EstimatorError> {
        let owners = a.owners();
        let shared: Vec<usize> = (0..a.ncols()).filter(|j| owners[*j].is_none()).collect();
        let largest = (a.squares() + d.component_mul(d)).iter().copied().fold(0.0, f64::max).sqrt();
        let factored: Vec<Factored> =
            a.blocks.iter().enumerate().map(|(k, block)| factored(block, k, &owners, &shared, d)).collect();
        let (q, r) = of_shared(&factored, &shared, d);
        let triangles = factored.iter().map(|f| f.r.view((0, 0), (f.own.len(), f.own.len())));
        let is_free = |v: &f64| v.is_nan() || v.abs() <= f64::EPSILON * largest;
        let free = triangles.chain([r.as_view()]).any(|triangle| triangle.diagonal().iter().any(is_free));
        let covariance = (!free).then(|| covariance(&factored, &shared, &r, a.ncols())).flatten();
        let covariance = covariance.ok_or(EstimatorError::NotPositiveDefinite { what: "posterior" })?;
        let mut first = 0;
        let mut blocks = Vec::with_capacity(factored.len());
        for (f, block) in factored.into_iter().zip(a.blocks.iter()) {
            let below = f.r.nrows() - f.own.len();
            let basis = if shared.is_empty() { f.q } else { spread(&f, &q.rows(first, below).into_owned()) };
            first += below;
            blocks.push(Part { rows: block.rows.clone(), own: f.own, basis });
        }
        let of_prior = q.rows(first, shared.len()).into_owned();
        Ok(Self { n_row: a.nrows(), blocks, shared, of_prior, covariance })
    }

    /// (AᵀA + diag(d)²) inverse, p x p.
    pub(crate) fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The part of a vector (m + p) that is orthogonal to the range, up to rounding.
    pub(crate) fn outside(&self, v: &DVector<f64>) -> DVector<f64> {
        let s = self.shared.len();
        let of_prior = DVector::from_iterator(s, self.shared.iter().map(|j| v[self.n_row + j]));
        let mut along = self.of_prior.tr_mul(&of_prior);
        let mut parts = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let part = block.gather(v, self.n_row);
            let mut coefficients = block.basis.tr_mul(&part);
            along += coefficients.rows(block.own.len(), s);
            coefficients.resize_vertically_mut(block.own.len(), 0.0);
            parts.push((part, coefficients));
        }
        let mut outside = v.clone();
        for (block, (part, coefficients)) in self.blocks.iter().zip(parts) {
            let n = block.own.len();
            let mut all = coefficients.resize_vertically(n + s, 0.0);
            all.rows_mut(n, s).copy_from(&along);
            block.scatter(&(part - &block.basis * all), self.n_row, &mut outside);
        }
        let left = of_prior - &self.of_prior * along;
        for (value, j) in left.iter().zip(&self.shared) {
            outside[self.n_row + j] = *value;
        }
        outside
    }
}

impl Part {
    fn gather(&self, v: &DVector<f64>, n_row: usize) -> DVector<f64> {
        let of_rows = v.rows(self.rows.start, self.rows.len());
        let of_prior = self.own.iter().map(|j| v[n_row + j]);
        DVector::from_iterator(self.rows.len() + self.own.len(), of_rows.iter().copied().chain(of_prior))
    }

    fn scatter(&self, part: &DVector<f64>, n_row: usize, v: &mut DVector<f64>) {
        let m = self.rows.len();
        v.rows_mut(self.rows.start, m).copy_from(&part.rows(0, m));
        for (k, j) in self.own.iter().enumerate() {
            v[n_row + j] = part[m + k];
        }
    }
}

/// Q and R of a block over the prior's rows of its own columns, these columns first.
fn factored(
    block: &BlockRow,
    k: usize,
    owners: &[Option<usize>],
    shared: &[usize],
    d: &DVector<f64>,
) -> Factored {
    let places = 0..block.columns.len();
    let (own, others): (Vec<usize>, Vec<usize>) = places.partition(|i| owners[block.columns[*i]] == Some(k));
    let (m, n) = (block.rows.len(), own.len());
    let mut rows = DMatrix::zeros(m + n, n + others.len());
    for (to, &from) in own.iter().chain(&others).enumerate() {
        rows.view_mut((0, to), (m, 1)).copy_from(&block.values.column(from));
    }
    let own: Vec<usize> = own.iter().map(|i| block.columns[*i]).collect();
    for (i, &j) in own.iter().enumerate() {
        rows[(m + i, i)] = d[j];
    }
    let places = others.iter().filter_map(|i| shared.binary_search(&block.columns[*i]).ok()).collect();
    let (q, r) = factors(rows);
    Factored { own, places, q, r }
}

/// Q and R of what the blocks left for the shared columns, over the prior's rows of these.
fn of_shared(factored: &[Factored], shared: &[usize], d: &DVector<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let s = shared.len();
    let below: usize = factored.iter().map(|f| f.r.nrows() - f.own.len()).sum();
    let mut rows = DMatrix::zeros(if s == 0 { 0 } else { below + s }, s);
    let mut first = 0;
    for f in factored.iter().filter(|_| s > 0) {
        let n = f.own.len();
        let below = f.r.nrows() - n;
        for (column, &place) in f.places.iter().enumerate() {
            rows.view_mut((first, place), (below, 1)).copy_from(&f.r.view((n, n + column), (below, 1)));
        }
        first += below;
    }
    for (i, &j) in shared.iter().enumerate() {
        rows[(first + i, i)] = d[j];
    }
    factors(rows)
}

/// Q and R, of nothing too.
fn factors(rows: DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let (m, p) = rows.shape();
    if rows.is_empty() { (DMatrix::zeros(m, 0), DMatrix::zeros(0, p)) } else { qr::factors(rows) }
}

/// The basis of a block: its own range, and its share of that of the shared columns.
fn spread(f: &Factored, of_block: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, s) = (f.own.len(), of_block.ncols());
    let mut basis = DMatrix::zeros(f.q.nrows(), n + s);
    basis.columns_mut(0, n).copy_from(&f.q.columns(0, n));
    basis.columns_mut(n, s).copy_from(&(f.q.columns(n, of_block.nrows()) * of_block));
    basis
}

/// The inverse of RᵀR, R the triangle of the whole with the own columns first: R⁻¹ R⁻ᵀ, in the order of the columns.
fn covariance(factored: &[Factored], shared: &[usize], r: &DMatrix<f64>, p: usize) -> Option<DMatrix<f64>> {
    let s = shared.len();
    let inverse = |r: DMatrix<f64>| r.solve_upper_triangular(&DMatrix::identity(r.nrows(), r.ncols()));
    let of_shared = inverse(r.clone())?;
    // The columns of R^-1 that belong to the shared ones, in all rows.
    let mut right = DMatrix::zeros(p, s);
    for (i, &j) in shared.iter().enumerate() {
        right.row_mut(j).copy_from(&of_shared.row(i));
    }
    let mut own = Vec::with_capacity(factored.len());
    for f in factored {
        let n = f.own.len();
        let of_own = inverse(f.r.view((0, 0), (n, n)).into_owned())?;
        let beside = f.r.view((0, n), (n, f.places.len())) * of_shared.select_rows(&f.places);
        let of_block = -(&of_own * beside);
        for (i, &j) in f.own.iter().enumerate() {
            right.row_mut(j).copy_from(&of_block.row(i));
        }
        own.push(&of_own * of_own.transpose());
    }
    let mut covariance = if s == 0 { DMatrix::zeros(p, p) } else { &right * right.transpose() };
    for (f, own) in factored.iter().zip(own) {
        for (a, &i) in f.own.iter().enumerate() {
            for (b, &j) in f.own.iter().enumerate() {
                covariance[(i, j)] = if s == 0 { own[(a, b)] } else { covariance[(i, j)] + own[(a, b)] };
            }
        }
    }
    Some(covariance)
}
