//! Least squares with a block-angular matrix: every block's own columns are eliminated by reflections within its rows, what is
//! left of the rows is stacked and factored for the shared columns, and the own values follow by substitution.
//!
//! The stacked triangles are those of a QR of the whole with the own columns first (Björck 1996, section 6.3): products AᵀA,
//! which have twice the digits, are never formed. Deliberately without a basis: see `subspace.rs`, which is to be read next.

use nalgebra::{DMatrix, DVector};

use super::{BlockAngular, BlockRow};
use crate::qr;

/// Rows that hold one column each: entries d (p) and right-hand sides c (p), for |d x − c|².
pub(crate) struct Diagonal {
    pub(crate) entries: DVector<f64>,
    pub(crate) right: DVector<f64>,
}

/// What is left of a block: its own columns (positions in x), their triangle, and the shared columns and right-hand side beside it.
struct Reduced {
    own: Vec<usize>,
    triangle: DMatrix<f64>,
    /// Places among the shared columns that are solved for.
    shared: Vec<usize>,
    right: DVector<f64>,
    beside: DMatrix<f64>,
}

/// Rows that the shared columns have yet to answer.
struct Rest {
    shared: Vec<usize>,
    rows: DMatrix<f64>,
}

impl BlockAngular {
    /// The x (length p) that minimises |A x − b|² and the squares of the diagonal rows, with zeros for the columns that are not
    /// `free`. `None` when it is not finite.
    pub(crate) fn least_squares(
        &self,
        free: &[usize],
        right: &DVector<f64>,
        diagonals: &[Diagonal],
    ) -> Option<DVector<f64>> {
        let owners = self.owners();
        let mut is_free = vec![false; self.ncols()];
        for &j in free {
            is_free[j] = true;
        }
        let shared: Vec<usize> = free.iter().copied().filter(|j| owners[*j].is_none()).collect();
        let (mut blocks, mut rests) = (Vec::new(), Vec::new());
        for (k, block) in self.blocks.iter().enumerate() {
            let free = |place: &usize| is_free[block.columns[*place]];
            let (own, others): (Vec<usize>, Vec<usize>) =
                (0..block.columns.len()).filter(free).partition(|i| owners[block.columns[*i]] == Some(k));
            let (reduced, rest) = reduce(block, &own, &others, &shared, right, diagonals);
            blocks.push(reduced);
            rests.push(rest);
        }
        let of_shared = of_shared(&rests, &shared, diagonals)?;
        let mut x = DVector::zeros(self.ncols());
        for (value, &j) in of_shared.iter().zip(&shared) {
            x[j] = *value;
        }
        for Reduced { own, triangle, shared, right, beside } in blocks {
            let known =
                if shared.is_empty() { right } else { right - beside * of_shared.select_rows(&shared) };
            let solved = triangle.solve_upper_triangular(&known)?;
            for (value, &j) in solved.iter().zip(&own) {
                x[j] = *value;
            }
        }
        x.iter().all(|v| v.is_finite()).then_some(x)
    }
}

/// Eliminates the own columns of a block; `own` and `others` are places among its columns.
fn reduce(
    block: &BlockRow,
    own: &[usize],
    others: &[usize],
    shared: &[usize],
    right: &DVector<f64>,
    diagonals: &[Diagonal],
) -> (Reduced, Rest) {
    let (m, n, s) = (block.rows.len(), own.len(), others.len());
    let mut rows = DMatrix::zeros(m + diagonals.len() * n, n + s + 1);
    for (to, &from) in own.iter().chain(others).enumerate() {
        rows.view_mut((0, to), (m, 1)).copy_from(&block.values.column(from));
    }
    rows.view_mut((0, n + s), (m, 1)).copy_from(&right.rows(block.rows.start, m));
    let own: Vec<usize> = own.iter().map(|place| block.columns[*place]).collect();
    for (first, diagonal) in (m..).step_by(n.max(1)).zip(diagonals) {
        for (k, &j) in own.iter().enumerate() {
            rows[(first + k, k)] = diagonal.entries[j];
            rows[(first + k, n + s)] = diagonal.right[j];
        }
    }
    let whole = if rows.nrows() == 0 { rows } else { qr::triangle(rows) };
    let is_other = |j: &usize| shared.binary_search(j).ok();
    let places: Vec<usize> = others.iter().filter_map(|place| is_other(&block.columns[*place])).collect();
    let below = whole.nrows().saturating_sub(n);
    let rest = Rest { shared: places.clone(), rows: whole.view((n, n), (below, s + 1)).into_owned() };
    let reduced = Reduced {
        own,
        triangle: whole.view((0, 0), (n, n)).into_owned(),
        shared: places,
        right: whole.view((0, n + s), (n, 1)).column(0).into_owned(),
        beside: whole.view((0, n), (n, s)).into_owned(),
    };
    (reduced, rest)
}

/// The values of the shared columns, from what the blocks left.
fn of_shared(rests: &[Rest], shared: &[usize], diagonals: &[Diagonal]) -> Option<DVector<f64>> {
    let s = shared.len();
    if s == 0 {
        return Some(DVector::zeros(0));
    }
    let m: usize = rests.iter().map(|rest| rest.rows.nrows()).sum();
    let mut rows = DMatrix::zeros(m + diagonals.len() * s, s + 1);
    let mut first = 0;
    for Rest { shared, rows: of_block } in rests {
        for (column, &place) in of_block.column_iter().zip(shared.iter().chain([&s])) {
            rows.view_mut((first, place), (of_block.nrows(), 1)).copy_from(&column);
        }
        first += of_block.nrows();
    }
    for (first, diagonal) in (m..).step_by(s).zip(diagonals) {
        for (k, &j) in shared.iter().enumerate() {
            rows[(first + k, k)] = diagonal.entries[j];
            rows[(first + k, s)] = diagonal.right[j];
        }
    }
    let triangle = qr::triangle(rows);
    let right = triangle.view((0, s), (s, 1)).column(0).into_owned();
    triangle.view((0, 0), (s, s)).solve_upper_triangular(&right)
}
