//! Orthonormal basis and triangle of stacked rows, fast where the columns are many.
//!
//! A study with values of its own for every record has hundreds of parameters; reflections one column at a time then cost more
//! than all runs. Many columns are made orthonormal by two Cholesky factors instead, the second of which removes the rounding
//! errors of the first (CholeskyQR2: Yamamoto, Nakatsukasa, Yanagisawa and Fukaya 2015), as long as the first leaves them
//! nearly orthonormal; else by reflections. A few columns always take reflections, so that their bits do not depend on this
//! file. Read next: `score.rs`.

use nalgebra::DMatrix;

/// So many columns at most are left to reflections.
const FEW: usize = 64;
/// Largest entry by which the products of the columns may differ from the unit matrix after the first factor: with less the
/// second factor leaves them orthonormal to rounding.
const NEARLY: f64 = 0.1;

/// The triangle R of A = QR, A of m x p: RᵀR = AᵀA. The signs of its rows are arbitrary.
pub(crate) fn triangle(a: DMatrix<f64>) -> DMatrix<f64> {
    match fast(&a) {
        Some(Fast { first, second, .. }) => second * first,
        None => a.qr().unpack_r(),
    }
}

/// Q and R of A = QR.
pub(crate) fn factors(a: DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let found = fast(&a)
        .and_then(|Fast { nearly, first, second }| Some((nearly * inverse(&second)?, second * first)));
    found.unwrap_or_else(|| {
        let qr = a.qr();
        (qr.q(), qr.unpack_r())
    })
}

/// A = nearly · first, nearly = Q · second; both factors upper triangles.
struct Fast {
    nearly: DMatrix<f64>,
    first: DMatrix<f64>,
    second: DMatrix<f64>,
}

fn fast(a: &DMatrix<f64>) -> Option<Fast> {
    let (m, p) = a.shape();
    if p <= FEW || m < p {
        return None;
    }
    // Of columns of length one: how large parameters are in their units must not count as a bad condition.
    let lengths: Vec<f64> = a.column_iter().map(|column| column.norm()).collect();
    if lengths.iter().any(|length| !(*length > f64::MIN_POSITIVE && length.is_finite())) {
        return None;
    }
    let mut unit = a.clone();
    for (mut column, length) in unit.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let mut first = (unit.transpose() * &unit).cholesky()?.unpack().transpose();
    let nearly = unit * inverse(&first)?;
    let products = nearly.transpose() * &nearly;
    let is_near = (&products - DMatrix::identity(p, p)).amax() < NEARLY;
    let second = products.cholesky().filter(|_| is_near)?.unpack().transpose();
    for (mut column, length) in first.column_iter_mut().zip(&lengths) {
        column *= *length;
    }
    Some(Fast { nearly, first, second })
}

fn inverse(triangle: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let p = triangle.ncols();
    triangle.solve_upper_triangular(&DMatrix::identity(p, p))
}

#[cfg(test)]
mod tests {
    use super::*;

    const P: usize = FEW + 6;

    /// Columns of very different lengths that are far from orthogonal; `apart` is how far each is from the others.
    fn columns(apart: f64) -> DMatrix<f64> {
        DMatrix::from_fn(500, P, |i, j| {
            let x = (i as f64 + 0.5) / 500.0;
            let size = 10.0_f64.powf((j % 7) as f64 * 3.0 - 9.0);
            size * ((1.0 + 0.01 * j as f64) * x).cos() + if i % P == j { size * apart } else { 0.0 }
        })
    }

    fn check(a: &DMatrix<f64>) {
        let (q, r) = factors(a.clone());
        assert!((q.tr_mul(&q) - DMatrix::identity(P, P)).amax() < 1e-13, "orthonormal to rounding");
        for j in 0..P {
            let left = (a.column(j) - &q * r.column(j)).norm();
            assert!(left < 1e-13 * a.column(j).norm(), "column {j}: {left:e}");
        }
        let plain = a.clone().qr().unpack_r();
        let alike = triangle(a.clone());
        for (i, j) in (0..P).flat_map(|i| (i..P).map(move |j| (i, j))) {
            let (a, b) = (alike[(i, j)].abs(), plain[(i, j)].abs());
            // The condition of the columns, below 1e4 here, times rounding.
            assert!((a - b).abs() < 1e-11 * plain.column(j).norm(), "({i}, {j}): {a} and {b}");
        }
    }

    #[test]
    fn many_columns_have_the_factors_that_reflections_give() {
        let a = columns(0.3);
        assert!(fast(&a).is_some(), "this is what the fast way is for");
        check(&a);
    }

    #[test]
    fn columns_that_depend_on_each_other_are_left_to_reflections() {
        let mut a = columns(0.3);
        let copy = a.column(3).into_owned();
        a.set_column(40, &copy);
        assert!(fast(&a).is_none());
        let (q, _) = factors(a);
        assert!((q.tr_mul(&q) - DMatrix::identity(P, P)).amax() < 1e-13);
    }

    #[test]
    fn few_columns_have_the_bits_of_reflections() {
        let a = columns(0.3).columns(0, FEW).into_owned();
        assert_eq!(triangle(a.clone()), a.qr().unpack_r());
    }
}
