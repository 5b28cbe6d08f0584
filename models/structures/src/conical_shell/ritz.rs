//! Modes of a clamped-free conical shell for one number of circumferential waves, by Ritz's method in (u, v, w).
//!
//! Donnell's strains; displacements are (s − s1)^k times Legendre polynomials, with k = 1 for u and v and 2 for w, so that the small end is
//! clamped and the other one free by itself. Without in-plane inertia the mass has no rows for u and v, which is static condensation.
//! Next file to read: [`super::model`].

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::legendre::{gauss, legendre};

/// The middle surface of a cone, between two distances s from its apex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Half angle α at the apex in rad.
    pub half_angle: f64,
    /// Distances s1 and s2 of the clamped and of the free end from the apex along the surface, in m.
    pub ends: [f64; 2],
}

impl Cone {
    /// ∫ s ds between the ends, in m².
    pub(crate) fn moment(&self) -> f64 {
        0.5 * (self.ends[1].powi(2) - self.ends[0].powi(2))
    }
}

/// What a shell is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Young's modulus E in Pa.
    pub young: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Density ρ in kg/m³.
    pub density: f64,
    /// Thickness h in m.
    pub thickness: f64,
}

/// A mode: w = W(s) cos nθ with the mean of U² + V² + W² over s ds equal to one, W not negative at the free end.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellMode {
    /// Square of the circular frequency in 1/s².
    pub square: f64,
    /// Coefficients of W.
    coefficients: DVector<f64>,
}

impl ShellMode {
    /// Frequency in Hz.
    pub fn frequency(&self) -> f64 {
        self.square.sqrt() / std::f64::consts::TAU
    }
}

/// The integrals of the energy for one number of waves; what the wall is made of only weighs them.
#[derive(Clone, Debug)]
pub struct Ritz {
    cone: Cone,
    terms: usize,
    /// Membrane energy: parts that go with 1, ν and (1 − ν)/2; all 3P × 3P.
    membrane: [DMatrix<f64>; 3],
    /// Bending energy: parts that go with 1, ν and 2 (1 − ν).
    bending: [DMatrix<f64>; 3],
    mass: DMatrix<f64>,
}

/// Values of one family of functions at the points of the rule, with two derivatives; functions × points.
struct Family([DMatrix<f64>; 3]);

impl Family {
    fn new(cone: &Cone, terms: usize, power: i32, nodes: &[[f64; 2]]) -> Self {
        let columns: Vec<Vec<[f64; 3]>> =
            nodes.iter().map(|[x, _]| functions(cone, terms, power, *x)).collect();
        let of = |k: usize| DMatrix::from_fn(terms, nodes.len(), |i, j| columns[j][i][k]);
        Self([of(0), of(1), of(2)])
    }
}

/// (s − s1)^k P_i with its derivatives by s, at x = −1 to 1 along the shell.
fn functions(cone: &Cone, terms: usize, power: i32, x: f64) -> Vec<[f64; 3]> {
    let half = 0.5 * (cone.ends[1] - cone.ends[0]);
    let a = half * (1.0 + x);
    let k = f64::from(power);
    let weight = [
        a.powi(power),
        k * a.powi(power - 1),
        if power > 1 { k * (k - 1.0) * a.powi(power - 2) } else { 0.0 },
    ];
    let product = |[p, d, dd]: [f64; 3]| {
        let (d, dd) = (d / half, dd / (half * half));
        [weight[0] * p, weight[0] * d + weight[1] * p, weight[0] * dd + 2.0 * weight[1] * d + weight[2] * p]
    };
    legendre(terms, x).into_iter().map(product).collect()
}

/// Functions of u, v and w below each other, all at the same points.
fn stacked(parts: [&DMatrix<f64>; 3]) -> DMatrix<f64> {
    let (p, q) = parts[0].shape();
    DMatrix::from_fn(3 * p, q, |i, j| parts[i / p][(i % p, j)])
}

/// Columns times a factor of their point.
fn scaled(matrix: &DMatrix<f64>, factor: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let mut scaled = matrix.clone();
    scaled.column_iter_mut().enumerate().for_each(|(j, mut column)| column *= factor(j));
    scaled
}

impl Ritz {
    /// The integrals for `waves` waves around, with `terms` functions for each displacement.
    ///
    /// With m = n/sin α (Donnell 1933; Leissa 1973, ch. 5): ε_s = u', ε_θ = (u − m v)/s + w/(s tan α), γ = m u/s + v' − v/s, κ_s = −w'',
    /// κ_θ = m² w/s² − w'/s, κ_sθ = −m (w'/s − w/s²).
    pub fn new(cone: Cone, waves: usize, terms: usize) -> Self {
        let nodes = gauss(3 * terms);
        let half = 0.5 * (cone.ends[1] - cone.ends[0]);
        let s: Vec<f64> = nodes.iter().map(|[x, _]| cone.ends[0] + half * (1.0 + x)).collect();
        let weight = |j: usize| half * nodes[j][1] * s[j];
        let inner = |a: &DMatrix<f64>, b: &DMatrix<f64>| scaled(a, weight) * b.transpose();
        let m = waves as f64 / cone.half_angle.sin();
        let Family([u, du, _]) = &Family::new(&cone, terms, 1, &nodes);
        let Family([w, dw, ddw]) = &Family::new(&cone, terms, 2, &nodes);
        let zero = &DMatrix::zeros(terms, nodes.len());
        let by = |a: &DMatrix<f64>, c: f64, power: i32| scaled(a, |j| c * s[j].powi(power));
        // u and v have the same functions.
        let stretch_s = stacked([du, zero, zero]);
        let stretch_t = stacked([&by(u, 1.0, -1), &by(u, -m, -1), &by(w, 1.0 / cone.half_angle.tan(), -1)]);
        let shear = stacked([&by(u, m, -1), &(du - by(u, 1.0, -1)), zero]);
        let bend_s = stacked([zero, zero, &(-ddw)]);
        let bend_t = stacked([zero, zero, &(by(w, m * m, -2) - by(dw, 1.0, -1))]);
        let twist = stacked([zero, zero, &(by(w, m, -2) - by(dw, m, -1))]);
        let energy = |a: &DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>| {
            [inner(a, a) + inner(b, b), inner(a, b) + inner(b, a), inner(c, c)]
        };
        let displacements = [[u, zero, zero], [zero, u, zero], [zero, zero, w]].map(stacked);
        let mass = displacements
            .iter()
            .map(|of| inner(of, of))
            .fold(DMatrix::zeros(3 * terms, 3 * terms), |a, b| a + b);
        let membrane = energy(&stretch_s, &stretch_t, &shear);
        let bending = energy(&bend_s, &bend_t, &twist);
        Self { cone, terms, membrane, bending, mass }
    }

    /// The lowest modes, the lowest first; `None` when the wall's numbers give no positive stiffness and mass.
    ///
    /// M x = μ K x with μ = 1/ω² by Cholesky's factor of K: the largest μ are those of the lowest modes, which keep their digits.
    pub fn modes(&self, wall: &Wall, in_plane_inertia: bool, count: usize) -> Option<Vec<ShellMode>> {
        let Wall { young, poisson, density, thickness } = *wall;
        let stretching = young * thickness / (1.0 - poisson * poisson);
        let bending = stretching * thickness * thickness / 12.0;
        let sum = |[one, two, three]: &[DMatrix<f64>; 3], by: f64| one + two * poisson + three * by;
        let stiffness = sum(&self.membrane, 0.5 * (1.0 - poisson)) * stretching
            + sum(&self.bending, 2.0 * (1.0 - poisson)) * bending;
        let gram = self.gram(in_plane_inertia);
        let (squares, vectors) = lowest(&stiffness, &(&gram * (density * thickness)), count)?;
        let mode = |(square, x): (f64, DVector<f64>)| {
            let mut coefficients = x.rows(2 * self.terms, self.terms).into_owned();
            let size = (x.dot(&(&gram * &x)) / self.cone.moment()).sqrt();
            let sign = if self.value(&coefficients, self.cone.ends[1]) < 0.0 { -1.0 } else { 1.0 };
            coefficients *= sign / size;
            ShellMode { square, coefficients }
        };
        Some(squares.into_iter().zip(vectors).map(mode).collect())
    }

    /// ∫ of the squares of the displacements that have inertia, by s ds.
    fn gram(&self, in_plane_inertia: bool) -> DMatrix<f64> {
        let mut gram = self.mass.clone();
        if !in_plane_inertia {
            gram.rows_mut(0, 2 * self.terms).fill(0.0);
        }
        gram
    }

    fn value(&self, coefficients: &DVector<f64>, s: f64) -> f64 {
        let [s1, s2] = self.cone.ends;
        let x = 2.0 * (s - s1) / (s2 - s1) - 1.0;
        functions(&self.cone, self.terms, 2, x)
            .iter()
            .zip(coefficients.iter())
            .map(|([f, ..], c)| c * f)
            .sum()
    }

    /// W of a mode at a distance s from the apex.
    pub fn shape(&self, mode: &ShellMode, s: f64) -> f64 {
        self.value(&mode.coefficients, s)
    }
}

/// Iterations of the eigenvalue problem per row; it takes two.
const ITERATIONS_PER_ROW: usize = 60;

/// The lowest ω² of K x = ω² M x with their vectors.
fn lowest(
    stiffness: &DMatrix<f64>,
    mass: &DMatrix<f64>,
    count: usize,
) -> Option<(Vec<f64>, Vec<DVector<f64>>)> {
    let n = stiffness.nrows();
    if !stiffness.iter().chain(mass).all(|v| v.is_finite()) {
        return None;
    }
    // Rows of different units are made comparable.
    let scale = stiffness.diagonal().map(|k| 1.0 / k.sqrt());
    let equal = |matrix: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| scale[i] * matrix[(i, j)] * scale[j]);
    let factor = Cholesky::new(equal(stiffness))?.unpack();
    let half = factor.solve_lower_triangular(&equal(mass))?;
    let reduced = factor.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::try_new(
        0.5 * (&reduced + reduced.transpose()),
        f64::EPSILON,
        ITERATIONS_PER_ROW * n,
    )?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order.truncate(count);
    let squares: Vec<f64> = order.iter().map(|i| 1.0 / eigen.eigenvalues[*i]).collect();
    let back = |i: &usize| {
        Some(factor.tr_solve_lower_triangular(&eigen.eigenvectors.column(*i))?.component_mul(&scale))
    };
    let vectors = order.iter().map(back).collect::<Option<Vec<_>>>()?;
    squares.iter().all(|square| *square > 0.0 && square.is_finite()).then_some((squares, vectors))
}
