//! The eigenvalues of a real matrix, small ones beside large ones.
//!
//! Independent blocks are taken one by one, each is balanced (Parlett & Reinsch 1969), and Francis' double-shift QR iteration
//! brings it to real Schur form. Next file to read: [`super::sensitivity`].

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::SpectrumError;
use super::component::{block, components};

/// QR steps allowed per eigenvalue; three are usual (Golub & Van Loan 2013, §7.5.6).
const STEPS: usize = 60;

/// All poles of de/dt = A e, in 1/time, sorted by modulus, then by imaginary part.
///
/// # Errors
/// When an entry is not finite, or the iteration does not converge.
pub fn poles(a: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, SpectrumError> {
    if a.iter().any(|v| !v.is_finite()) {
        return Err(SpectrumError::NotAMatrix { n: a.nrows() });
    }
    let mut poles = Vec::with_capacity(a.nrows());
    for rows in components(&[a], 0.0) {
        poles.extend(of_block(block(a, &rows))?);
    }
    sort(&mut poles);
    Ok(poles)
}

/// The largest real part; −∞ without poles.
pub(super) fn rightmost(poles: &[Complex<f64>]) -> f64 {
    poles.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max)
}

/// Sorts by modulus, then by imaginary part.
pub(super) fn sort(poles: &mut [Complex<f64>]) {
    poles.sort_by(|p, q| p.norm().total_cmp(&q.norm()).then(p.im.total_cmp(&q.im)));
}

pub(super) fn of_block(mut a: DMatrix<f64>) -> Result<Vec<Complex<f64>>, SpectrumError> {
    let n = a.nrows();
    if n == 1 {
        return Ok(vec![Complex::new(a[(0, 0)], 0.0)]);
    }
    balance_parlett_reinsch(&mut a);
    if n == 2 {
        return Ok(of_two(&a, 0).to_vec());
    }
    let steps = STEPS * n;
    let schur = Schur::try_new(a.clone(), f64::EPSILON, steps)
        .or_else(|| Schur::try_new(turned(&a), f64::EPSILON, steps))
        .ok_or(SpectrumError::NotConverged { n })?;
    Ok(of_quasi_triangle(&schur.unpack().1))
}

/// The matrix seen in mirrored axes. The double shift of a matrix such as a cyclic permutation can stand still for ever; its
/// mirror image has the same poles and no such symmetry.
fn turned(a: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.nrows();
    let v = DVector::from_fn(n, |i, _| 1.0 + (i as f64).sin()).normalize();
    let mirror = DMatrix::identity(n, n) - &v * v.transpose() * 2.0;
    &mirror * a * &mirror
}

fn of_quasi_triangle(t: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let n = t.nrows();
    let mut poles = Vec::with_capacity(n);
    while poles.len() < n {
        let i = poles.len();
        if i + 1 < n && t[(i + 1, i)].abs() > 0.0 {
            poles.extend(of_two(t, i));
        } else {
            poles.push(Complex::new(t[(i, i)], 0.0));
        }
    }
    poles
}

/// The two eigenvalues of the diagonal block at `i`; neither of two real ones loses digits to the other.
fn of_two(t: &DMatrix<f64>, i: usize) -> [Complex<f64>; 2] {
    let (a, b, c, d) = (t[(i, i)], t[(i, i + 1)], t[(i + 1, i)], t[(i + 1, i + 1)]);
    let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
    let square = half * half + b * c;
    if square < 0.0 {
        let w = (-square).sqrt();
        return [Complex::new(mean, -w), Complex::new(mean, w)];
    }
    let large = mean + square.sqrt().copysign(mean);
    let small = if large.abs() > 0.0 { (a * d - b * c) / large } else { 0.0 };
    [Complex::new(small, 0.0), Complex::new(large, 0.0)]
}
