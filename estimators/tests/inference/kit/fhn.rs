//! Two FitzHugh-Nagumo oscillators seen through an unknown mixing matrix (Smelyanskiy, Luchinsky et al., eqs. 1.73 to 1.82 and Table
//! 1.5): v̇ = α v + b v² − v³ − q + η + √D ξ, q̇ = −β q + γ v, y = X v. Eliminating q leaves a memory of y and a decay as functions.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use starlings_estimators::inference::{Basis, Function, Polynomial, Rule};

use super::sde::{heun, record, rng};

pub const BETA: f64 = 0.05;
pub const H: f64 = 0.05;
/// X row by row, eta, alpha, b, gamma, q0.
pub const TRUTH: [f64; 14] = [1.7, 0.8, 0.2, 0.9, 0.4, 0.3, -0.35, -0.2, 1.35, 1.2, 0.052, 0.044, 0.3, 0.1];
pub const NOISE: [f64; 2] = [4e-4, 3e-4];

fn pair(theta: &[f64], k: usize) -> Vector2<f64> {
    Vector2::new(theta[k], theta[k + 1])
}

/// Rows y1, y2, and the memories ∫ e^{−β(t−s)} y ds by the trapezoidal rule.
pub fn recording(seed: u64, n: usize) -> Vec<[f64; 4]> {
    let mut rng = rng(seed);
    let t = TRUTH;
    let drift = |_: f64, [v1, v2, q1, q2]: &[f64; 4]| {
        let cubic = |v: f64, q: f64, k: usize| t[6 + k] * v + t[8 + k] * v * v - v.powi(3) - q + t[4 + k];
        [cubic(*v1, *q1, 0), cubic(*v2, *q2, 1), -BETA * q1 + t[10] * v1, -BETA * q2 + t[11] * v2]
    };
    let mut root = [[0.0; 4]; 4];
    (root[0][0], root[1][1]) = (NOISE[0].sqrt(), NOISE[1].sqrt());
    let v = record(n, (H, 5), [0.0, 0.0, t[12], t[13]], |t, h, x| heun(&mut rng, (t, h), x, &root, &drift));
    let decay = (-BETA * H).exp();
    let mut memory = [0.0; 2];
    let mut before: Option<[f64; 2]> = None;
    let row = |x: [f64; 4]| {
        let y = [t[0] * x[0] + t[1] * x[1], t[2] * x[0] + t[3] * x[1]];
        if let Some(before) = before {
            memory = std::array::from_fn(|i| decay * memory[i] + 0.5 * H * (decay * before[i] + y[i]));
        }
        before = Some(y);
        [y[0], y[1], memory[0], memory[1]]
    };
    v.into_iter().map(row).collect()
}

/// Cubic polynomial in y, memories and decay: 13 functions.
pub fn basis() -> Arc<Basis> {
    let cubic = Polynomial::new(&["y1", "y2", "m1", "m2"], 2, &[0, 1], 3, true);
    let basis = Basis::new(2, 2)
        .with(Rule::MidPoint, cubic)
        .and_then(|b| b.with(Rule::MidPoint, Function::of_inputs("memory1", |_, x| x[2])))
        .and_then(|b| b.with(Rule::MidPoint, Function::of_inputs("memory2", |_, x| x[3])))
        .and_then(|b| b.with(Rule::MidPoint, Function::of_inputs("decay", |t, _| (-BETA * t).exp())));
    Arc::new(basis.unwrap())
}

fn mixing(theta: &[f64]) -> Matrix2<f64> {
    Matrix2::new(theta[0], theta[1], theta[2], theta[3])
}

/// All 26 coefficients, equation after equation, of 14 unknowns.
pub fn coefficients(theta: &DVector<f64>) -> DVector<f64> {
    let theta = theta.as_slice();
    let x = mixing(theta);
    let Some(w) = x.try_inverse() else { return DVector::from_element(26, f64::NAN) };
    let diagonal = |k: usize| x * Matrix2::from_diagonal(&pair(theta, k)) * w;
    let (linear, memory) = (diagonal(6), -diagonal(10));
    let (constant, decay) = (x * pair(theta, 4), -x * pair(theta, 12));
    let power = |j: usize, term: usize| {
        let (a, b) = (w[(j, 0)], w[(j, 1)]);
        match term {
            3 => a * a,
            4 => 2.0 * a * b,
            5 => b * b,
            6 => a * a * a,
            7 => 3.0 * a * a * b,
            8 => 3.0 * a * b * b,
            _ => b * b * b,
        }
    };
    DVector::from_fn(26, |p, _| {
        let (l, term) = (p / 13, p % 13);
        let mixed = |factor: [f64; 2]| (0..2).map(|j| x[(l, j)] * factor[j] * power(j, term)).sum();
        match term {
            0 => constant[l],
            1 | 2 => linear[(l, term - 1)],
            3..=5 => mixed([theta[8], theta[9]]),
            6..=9 => mixed([-1.0, -1.0]),
            10 | 11 => memory[(l, term - 10)],
            _ => decay[l],
        }
    })
}

/// A start: the columns of X are eigenvectors of the linear terms plus `mix` times the memories', scaled so that the cubes have
/// the coefficient −1, with positive b.
pub fn start(c: &DMatrix<f64>, mix: f64) -> Option<DVector<f64>> {
    let block = |k: usize| Matrix2::from_fn(|i, j| c[(i, k + j)]);
    let m = block(1) + block(10) * mix;
    let values = m.eigenvalues()?;
    let vector = |value: f64| {
        let a = Vector2::new(m[(0, 1)], value - m[(0, 0)]);
        let b = Vector2::new(value - m[(1, 1)], m[(1, 0)]);
        (if a.norm() > b.norm() { a } else { b }).normalize()
    };
    let u = Matrix2::from_columns(&[vector(values[0]), vector(values[1])]);
    let w = u.try_inverse()?;
    let along = |w: &Matrix2<f64>, j: usize, first: usize, powers: &[f64]| {
        let row = (0..powers.len()).map(|k| (0..2).map(|i| w[(j, i)] * c[(i, first + k)]).sum::<f64>());
        row.zip(powers).map(|(r, p)| r * p).sum::<f64>() / powers.iter().map(|p| p * p).sum::<f64>()
    };
    let powers = |w: &Matrix2<f64>, j: usize| {
        let (a, b) = (w[(j, 0)], w[(j, 1)]);
        ([a * a, 2.0 * a * b, b * b], [a * a * a, 3.0 * a * a * b, 3.0 * a * b * b, b * b * b])
    };
    let scale = |j: usize| (-along(&w, j, 6, &powers(&w, j).1)).max(1e-3).sqrt();
    let x = u * Matrix2::from_diagonal(&Vector2::new(1.0 / scale(0), 1.0 / scale(1)));
    let w = x.try_inverse()?;
    let b = |w: &Matrix2<f64>, j: usize| along(w, j, 3, &powers(w, j).0);
    let sign = |j: usize| b(&w, j).signum();
    let x = x * Matrix2::from_diagonal(&Vector2::new(sign(0), sign(1)));
    let w = x.try_inverse()?;
    let inner = |k: usize| (w * block(k) * x).diagonal();
    let (eta, q0) = (w * c.fixed_view::<2, 1>(0, 0), -w * c.fixed_view::<2, 1>(0, 12));
    let (alpha, gamma) = (inner(1), -inner(10));
    let theta = [
        x[(0, 0)],
        x[(0, 1)],
        x[(1, 0)],
        x[(1, 1)],
        eta[0],
        eta[1],
        alpha[0],
        alpha[1],
        b(&w, 0),
        b(&w, 1),
        gamma[0],
        gamma[1],
        q0[0],
        q0[1],
    ];
    Some(DVector::from_row_slice(&theta))
}

/// The same unknowns with the oscillators in the other order.
pub fn swapped(theta: &DVector<f64>) -> DVector<f64> {
    let order = [1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12];
    DVector::from_fn(14, |k, _| theta[order[k]])
}
