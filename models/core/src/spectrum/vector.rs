//! Left and right eigenvectors of a matrix at poles that are already known, by inverse iteration on its Hessenberg form.
//!
//! A = Q H Qᵀ is reduced once; each pole then costs O(n²) (Golub & Van Loan 2013, §7.6.1). Next file to read:
//! [`super::sensitivity`].

use nalgebra::{Complex, DMatrix, DVector};

/// A real matrix in Hessenberg form.
pub(super) struct Reduced {
    h: DMatrix<f64>,
    q: DMatrix<Complex<f64>>,
}

/// Right eigenvector x and left eigenvector y of a pole, of unit length: A x = λ x, yᴴ A = λ yᴴ.
pub(super) struct Pair {
    pub(super) right: DVector<Complex<f64>>,
    pub(super) left: DVector<Complex<f64>>,
}

/// Steps of inverse iteration; the second already has full accuracy for a pole that is accurate.
const STEPS: usize = 3;

impl Reduced {
    pub(super) fn new(a: &DMatrix<f64>) -> Self {
        if a.nrows() < 3 {
            let n = a.nrows();
            return Self { h: a.clone(), q: DMatrix::identity(n, n) };
        }
        let (q, h) = a.clone().hessenberg().unpack();
        Self { h, q: q.map(|v| Complex::new(v, 0.0)) }
    }

    /// The eigenvectors of the eigenvalue nearest to `pole`.
    pub(super) fn vectors(&self, pole: Complex<f64>) -> Pair {
        let factors = Factors::new(&self.h, pole);
        let n = self.h.nrows();
        // Any start that no eigenvector is orthogonal to.
        let start = DVector::from_fn(n, |i, _| Complex::new(1.0, 0.5 * (i as f64 + 1.0).sin()));
        let iterate = |solve: &dyn Fn(&mut DVector<Complex<f64>>)| {
            let mut v = start.normalize();
            for _ in 0..STEPS {
                solve(&mut v);
                v = v.normalize();
            }
            &self.q * v
        };
        Pair { right: iterate(&|v| factors.solve(v)), left: iterate(&|v| factors.solve_adjoint(v)) }
    }
}

/// P L U = H − λ with neighbouring rows exchanged for the larger pivot.
struct Factors {
    /// U, upper triangular.
    upper: DMatrix<Complex<f64>>,
    /// Per step: whether rows k and k + 1 were exchanged, and the multiple of row k taken from row k + 1.
    steps: Vec<(bool, Complex<f64>)>,
}

impl Factors {
    fn new(h: &DMatrix<f64>, pole: Complex<f64>) -> Self {
        let n = h.nrows();
        let mut u = h.map(|v| Complex::new(v, 0.0));
        for i in 0..n {
            u[(i, i)] -= pole;
        }
        let mut steps = Vec::with_capacity(n.saturating_sub(1));
        for k in 0..n.saturating_sub(1) {
            let exchange = u[(k + 1, k)].norm() > u[(k, k)].norm();
            if exchange {
                u.swap_rows(k, k + 1);
            }
            let pivot = u[(k, k)];
            let multiple = if pivot.norm() > 0.0 { u[(k + 1, k)] / pivot } else { Complex::new(0.0, 0.0) };
            for j in k..n {
                let above = u[(k, j)];
                u[(k + 1, j)] -= multiple * above;
            }
            steps.push((exchange, multiple));
        }
        // The last pivot is zero for an exact pole: the smallest number that rounding could have left stands in for it.
        let least = f64::EPSILON * h.norm().max(pole.norm()).max(f64::MIN_POSITIVE / f64::EPSILON);
        for i in 0..n {
            if u[(i, i)].norm() < least {
                u[(i, i)] = Complex::new(least, 0.0);
            }
        }
        Self { upper: u, steps }
    }

    /// (H − λ)⁻¹ b in place.
    fn solve(&self, b: &mut DVector<Complex<f64>>) {
        for (k, &(exchange, multiple)) in self.steps.iter().enumerate() {
            if exchange {
                b.swap_rows(k, k + 1);
            }
            let above = b[k];
            b[k + 1] -= multiple * above;
        }
        // Every diagonal entry was made nonzero, so the triangular solves succeed.
        self.upper.solve_upper_triangular_mut(b);
    }

    /// (H − λ)⁻ᴴ b in place.
    fn solve_adjoint(&self, b: &mut DVector<Complex<f64>>) {
        self.upper.ad_solve_upper_triangular_mut(b);
        for (k, &(exchange, multiple)) in self.steps.iter().enumerate().rev() {
            let below = b[k + 1];
            b[k] -= multiple.conj() * below;
            if exchange {
                b.swap_rows(k, k + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::poles;

    #[test]
    fn both_vectors_of_every_pole_satisfy_their_equation() {
        let n = 12;
        let a = DMatrix::from_fn(n, n, |i, j| ((3 * i + 7 * j + i * j) as f64).sin());
        let complex = a.map(|v| Complex::new(v, 0.0));
        let reduced = Reduced::new(&a);
        for pole in poles(&a).expect("poles") {
            let Pair { right, left } = reduced.vectors(pole);
            // Rounding of the iteration, for poles of condition below a thousand.
            assert!((&complex * &right - &right * pole).norm() < 1e-11, "{pole}");
            assert!((complex.adjoint() * &left - &left * pole.conj()).norm() < 1e-11, "{pole}");
        }
    }
}
