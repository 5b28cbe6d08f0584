//! The corrected equation 1.42 of the chapter by Chebyshev collocation in (w, F): a discretisation that shares nothing with the model's.
//!
//! F is Airy's function; clamped at s1 in strains (ε_θ and the compatibility of u), free at s2.

use nalgebra::{DMatrix, DVector};
use starlings_structures::conical_shell::{Cone, Wall};

/// Differentiation matrix and points cos(πj/N), from 1 to −1 (Trefethen 2000, ch. 6).
fn chebyshev(n: usize) -> (DMatrix<f64>, DVector<f64>) {
    let x = DVector::from_fn(n + 1, |j, _| (std::f64::consts::PI * j as f64 / n as f64).cos());
    let sign = |j: usize| if j.is_multiple_of(2) { 1.0 } else { -1.0 };
    let c = |j: usize| sign(j) * if j == 0 || j == n { 2.0 } else { 1.0 };
    let mut d = DMatrix::from_fn(n + 1, n + 1, |i, j| if i == j { 0.0 } else { c(i) / c(j) / (x[i] - x[j]) });
    for i in 0..=n {
        d[(i, i)] = -d.row(i).sum();
    }
    (d, x)
}

/// Derivatives and powers of s at the points.
struct Operators {
    d: [DMatrix<f64>; 4],
    s: DVector<f64>,
    m2: f64,
}

impl Operators {
    fn new(cone: &Cone, waves: usize, n: usize) -> Self {
        let (d, x) = chebyshev(n);
        let [s1, s2] = cone.ends;
        let d1 = d * (2.0 / (s2 - s1));
        let d2 = &d1 * &d1;
        let (d3, d4) = (&d2 * &d1, &d2 * &d2);
        let s = x.map(|x| 0.5 * (s2 - s1) * x + 0.5 * (s1 + s2));
        Self { d: [d1, d2, d3, d4], s, m2: (waves as f64 / cone.half_angle.sin()).powi(2) }
    }

    fn power(&self, p: i32) -> DMatrix<f64> {
        DMatrix::from_diagonal(&self.s.map(|s| s.powi(p)))
    }

    /// Lap² on sin nθ: d⁴ + 2/s d³ − (1 + 2m²)/s² d² + (1 + 2m²)/s³ d − m²(4 − m²)/s⁴.
    fn bilaplacian(&self) -> DMatrix<f64> {
        let ([d1, d2, d3, d4], m2) = (&self.d, self.m2);
        let k = 1.0 + 2.0 * m2;
        d4 + self.power(-1) * d3 * 2.0 - self.power(-2) * d2 * k + self.power(-3) * d1 * k
            - self.power(-4) * (m2 * (4.0 - m2))
    }

    /// (1/s) d − m²/s².
    fn ring(&self) -> DMatrix<f64> {
        self.power(-1) * &self.d[0] - self.power(-2) * self.m2
    }

    /// The boundary conditions: rows for w and rows for F, each at its end.
    fn boundary(&self, nu: f64) -> ([DMatrix<f64>; 4], [DMatrix<f64>; 4]) {
        let ([d1, d2, ..], m2) = (&self.d, self.m2);
        let (clamped, free) = (self.s.len() - 1, 0);
        let one = DMatrix::identity(self.s.len(), self.s.len());
        let at = |matrix: &DMatrix<f64>, end: usize| matrix.rows(end, 1).into_owned();
        let laplacian = d2 + self.ring();
        let moment = d2 + self.ring() * nu;
        let shear = d1 * laplacian - self.power(-1) * d1 * self.power(-1) * ((1.0 - nu) * m2);
        let hoop = d2 - self.ring() * nu;
        let along = self.ring() - d2 * nu;
        let compatible = d1 * (self.power(1) * &hoop) - along - d1 * self.power(-1) * (2.0 * (1.0 + nu) * m2);
        let w = [at(&one, clamped), at(d1, clamped), at(&moment, free), at(&shear, free)];
        let f = [at(&hoop, clamped), at(&compatible, clamped), at(&one, free), at(d1, free)];
        (w, f)
    }
}

/// The lowest frequencies in Hz with N + 1 points, in-plane inertia neglected.
pub(crate) fn collocation(cone: &Cone, wall: &Wall, waves: usize, n: usize, count: usize) -> Vec<f64> {
    let of = Operators::new(cone, waves, n);
    let n1 = n + 1;
    let Wall { young, poisson: nu, density, thickness: h } = *wall;
    let stretching = young * h;
    let bending = stretching * h * h / 12.0 / (1.0 - nu * nu);
    let mixed = of.power(-1) * &of.d[1] * (stretching / cone.half_angle.tan());
    let mut l = DMatrix::zeros(2 * n1, 2 * n1);
    // F counts in E h.
    l.view_mut((0, 0), (n1, n1)).copy_from(&(of.bilaplacian() * bending));
    l.view_mut((0, n1), (n1, n1)).copy_from(&(-&mixed));
    l.view_mut((n1, 0), (n1, n1)).copy_from(&mixed);
    l.view_mut((n1, n1), (n1, n1)).copy_from(&(of.bilaplacian() * stretching));
    let (w, f) = of.boundary(nu);
    let places = [n, n - 1, 0, 1];
    for (rows, block) in [(w, 0), (f, n1)] {
        for (row, place) in rows.into_iter().zip(places) {
            l.row_mut(block + place).fill(0.0);
            l.view_mut((block + place, block), (1, n1)).copy_from(&row);
        }
    }
    // L y = ω² ρh w on the inner points of the first block: the nonzero μ = 1/ω² of ρh L⁻¹ there.
    let scale = DVector::from_fn(2 * n1, |i, _| 1.0 / l.row(i).amax());
    l.row_iter_mut().zip(scale.iter()).for_each(|(mut row, s)| row *= *s);
    let inner: Vec<usize> = (2..n - 1).collect();
    let load =
        DMatrix::from_fn(
            2 * n1,
            inner.len(),
            |i, j| if i == inner[j] { density * h * scale[i] } else { 0.0 },
        );
    let solved = l.full_piv_lu().solve(&load).expect("a regular system");
    let compliance = DMatrix::from_fn(inner.len(), inner.len(), |i, j| solved[(inner[i], j)]);
    let values = compliance.complex_eigenvalues();
    let mut values: Vec<f64> =
        values.iter().filter(|v| v.re > 0.0 && v.im.abs() <= 1e-5 * v.re).map(|v| v.re).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values.iter().take(count).map(|v| v.sqrt().recip() / std::f64::consts::TAU).collect()
}
