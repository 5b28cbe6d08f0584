//! The estimator written out over all rows, sharing no code with the crate: F of L x P at every step, one dense solve per pass
//! (Smelyanskiy, Luchinsky et al., eq. 1.11).

use nalgebra::{DMatrix, DVector};

/// F(x, t), L x P, and v(x, t), length P.
pub type Drift<'a> = &'a dyn Fn(f64, &[f64]) -> (DMatrix<f64>, DVector<f64>);

/// The known part of the drift, length L.
pub type Offset<'a> = &'a dyn Fn(f64) -> DVector<f64>;

pub struct Dense {
    pub c: DVector<f64>,
    pub precision: DMatrix<f64>,
    pub d: DMatrix<f64>,
}

/// Coefficients for a given noise, and h/N times the squares of the residuals.
pub fn solve(rows: &[Vec<f64>], h: f64, f: Drift<'_>, offset: Offset<'_>, d: &DMatrix<f64>) -> Dense {
    let n_state = d.nrows();
    let inverse = d.clone().try_inverse().unwrap();
    let steps: Vec<(DMatrix<f64>, DVector<f64>, DVector<f64>)> = rows
        .windows(2)
        .enumerate()
        .map(|(n, pair)| {
            let mid: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| 0.5 * (a + b)).collect();
            let speed = DVector::from_fn(n_state, |l, _| (pair[1][l] - pair[0][l]) / h);
            let time = (n as f64 + 0.5) * h;
            let (f, v) = f(time, &mid);
            (f, v, speed - offset(time))
        })
        .collect();
    let p = steps[0].1.len();
    let (mut precision, mut w) = (DMatrix::zeros(p, p), DVector::zeros(p));
    for (f, v, speed) in &steps {
        let weighted = f.transpose() * &inverse;
        precision += &weighted * f * h;
        w += (&weighted * speed - v * 0.5) * h;
    }
    let c = precision.clone().lu().solve(&w).unwrap();
    let mut squares = DMatrix::zeros(n_state, n_state);
    for (f, _, speed) in &steps {
        let r = speed - f * &c;
        squares += &r * r.transpose();
    }
    Dense { c, precision, d: squares * (h / steps.len() as f64) }
}
