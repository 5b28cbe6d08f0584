//! The Lorenz system with noise (Smelyanskiy, Luchinsky et al., Tables 1.1 and 1.2).

use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3};
use starlings_estimators::inference::{Basis, Polynomial, Rule, Structure};

use super::sde::{heun, record, rk4, rng};

pub const NAMES: [&str; 3] = ["x1", "x2", "x3"];

pub fn drift(_t: f64, [x, y, z]: &[f64; 3]) -> [f64; 3] {
    [10.0 * (y - x), 28.0 * x - y - x * z, x * y - 8.0 / 3.0 * z]
}

/// D of Table 1.2, of which it gives D11 and D13.
pub fn diffusion() -> DMatrix<f64> {
    DMatrix::from_row_slice(3, 3, &[0.2867, 0.05, 0.1069, 0.05, 0.25, 0.04, 0.1069, 0.04, 0.22])
}

pub fn root(d: &DMatrix<f64>) -> [[f64; 3]; 3] {
    let root = Matrix3::from_fn(|i, j| d[(i, j)]).cholesky().unwrap().l();
    std::array::from_fn(|i| std::array::from_fn(|j| root[(i, j)]))
}

/// A recording of Table 1.1: D = τ², ten substeps.
pub fn strong(seed: u64, n: usize, h: f64, tau: f64) -> Vec<[f64; 3]> {
    let root = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { tau } else { 0.0 }));
    let mut rng = rng(seed);
    let warm = record(2000, (0.001, 1), [1.0, 1.0, 25.0], |t, h, x| heun(&mut rng, (t, h), x, &root, &drift));
    record(n, (h, 10), *warm.last().unwrap(), |t, h, x| heun(&mut rng, (t, h), x, &root, &drift))
}

/// A recording of Table 1.2, four substeps of fourth order.
pub fn weak(seed: u64, n: usize, h: f64, d: &DMatrix<f64>) -> Vec<[f64; 3]> {
    fine(seed, n, (h, 4), d)
}

/// The same with any number of substeps.
pub fn fine(seed: u64, n: usize, (h, substeps): (f64, usize), d: &DMatrix<f64>) -> Vec<[f64; 3]> {
    let (root, mut rng) = (root(d), rng(seed));
    let warm =
        record(20_000, (0.005, 4), [1.0, 1.0, 25.0], |t, h, x| rk4(&mut rng, (t, h), x, &root, &drift));
    record(n, (h, substeps), *warm.last().unwrap(), |t, h, x| rk4(&mut rng, (t, h), x, &root, &drift))
}

/// The nine monomials of Table 1.2.
pub fn basis() -> Arc<Basis> {
    basis_at(Rule::MidPoint)
}

pub fn basis_at(rule: Rule) -> Arc<Basis> {
    let quadratic = Polynomial::new(&NAMES, 3, &[0, 1, 2], 2, false);
    Arc::new(Basis::new(3, 0).with(rule, quadratic).unwrap())
}

/// The seven coefficients of Table 1.1, equation by equation.
pub fn seven(basis: &Basis) -> Structure {
    let functions: [&[&str]; 3] = [&["x1", "x2"], &["x1", "x2", "x1*x3"], &["x1*x2", "x3"]];
    Structure::by_equation(basis, &NAMES, &functions).unwrap()
}

pub const SEVEN: [f64; 7] = [-10.0, 10.0, 28.0, -1.0, -1.0, 1.0, -8.0 / 3.0];

/// The coefficients of Table 1.2, 3 x 9.
pub fn true_drift() -> DMatrix<f64> {
    let mut c = DMatrix::zeros(3, 9);
    for (i, j, value) in [
        (0, 0, -10.0),
        (0, 1, 10.0),
        (1, 0, 28.0),
        (1, 1, -1.0),
        (1, 5, -1.0),
        (2, 2, -8.0 / 3.0),
        (2, 4, 1.0),
    ] {
        c[(i, j)] = value;
    }
    c
}
