//! Tubes, inflows and dense matrices shared by the tests of the tube.
#![allow(clippy::unwrap_used, dead_code, reason = "test helpers; each test binary uses its part")]

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use starlings_haemodynamics::FsiTube;
use starlings_haemodynamics::fsi_tube::Layout;
use starlings_haemodynamics::fsi_tube::layout::Regions;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{History, Segment};
use starlings_models_core::{Drive, Model};

pub(crate) const MM_HG: f64 = 1333.22;
/// Stiffness of the five regions in octaves above the reference.
pub(crate) const OCTAVES: [f64; 5] = [0.5, 1.5, -0.5, 0.0, -1.0];

pub(crate) struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

pub(crate) fn tube(cells: usize, step: f64) -> FsiTube {
    let layout = Layout { cells, regions: Regions::Equal(5), step, ..Layout::default() };
    FsiTube::new(&layout, 25.0).unwrap()
}

/// Default parameters with the five regions' stiffness, and others by name.
pub(crate) fn values(model: &FsiTube, others: &[(&str, f64)]) -> Vec<f64> {
    let list = &model.spec().parameters;
    let mut theta: Vec<f64> = list.iter().map(|q| q.default.unwrap()).collect();
    for (value, octave) in theta.iter_mut().zip(OCTAVES) {
        *value = 5e6 * f64::exp2(octave);
    }
    for (name, value) in others {
        theta[list.iter().position(|q| q.name == *name).unwrap()] = *value;
    }
    theta
}

/// A half sine of 0.3 s in every beat of 0.8 s, in cm³/s.
pub(crate) fn inflow(t: f64) -> f64 {
    let phase = t.rem_euclid(0.8);
    if phase < 0.3 { 300.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

/// Advances by one segment from inflow `q[0]` to `q[1]`.
pub(crate) fn advance(model: &FsiTube, theta: &[f64], q: [f64; 2], dt: f64, x: &mut [f64]) {
    let slope = [(q[1] - q[0]) / dt];
    let segment = Segment {
        t0: 0.0,
        t1: dt,
        u0: &q[..1],
        slope: &slope,
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    model.advance(segment, theta, x).unwrap();
}

/// Advances by `n` steps of `dt` from time zero.
pub(crate) fn run(model: &FsiTube, theta: &[f64], dt: f64, n: usize, x: &mut [f64]) {
    for i in 0..n {
        advance(model, theta, [i, i + 1].map(|i| inflow(i as f64 * dt)), dt, x);
    }
}

pub(crate) fn outputs(model: &FsiTube, theta: &[f64], q: f64, slope: f64, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; model.spec().n_output()];
    let u = Drive { value: &[q], slope: &[slope], history: &NoHistory };
    model.output(0.0, x, theta, u, &mut y);
    y
}

/// The state to which a beat of 0.8 s leads back: the affine map of one beat has one fixed point.
pub(crate) fn periodic(model: &FsiTube, theta: &[f64], dt: f64) -> Vec<f64> {
    let n = model.spec().n_state();
    let steps = (0.8 / dt).round() as usize;
    let mut unit = DMatrix::<f64>::identity(n, n);
    for mut column in unit.column_iter_mut() {
        advance(model, theta, [0.0; 2], dt, column.as_mut_slice());
    }
    let mut forced = vec![0.0; n];
    run(model, theta, dt, steps, &mut forced);
    let beat = power(unit, steps);
    let left = DMatrix::identity(n, n) - beat;
    left.lu().solve(&DVector::from_vec(forced)).unwrap().as_slice().to_vec()
}

fn power(mut base: DMatrix<f64>, mut exponent: usize) -> DMatrix<f64> {
    let mut result = DMatrix::identity(base.nrows(), base.nrows());
    while exponent > 0 {
        if exponent % 2 == 1 {
            result = &result * &base;
        }
        base = &base * &base;
        exponent /= 2;
    }
    result
}

/// The tube's equations dx/dt = A x + b Q_in + b' dQ_in/dt as dense matrices, written out independently of the model.
pub(crate) struct Dense {
    pub(crate) a: DMatrix<f64>,
    pub(crate) inflow: DVector<f64>,
    pub(crate) slope: DVector<f64>,
    pub(crate) added_mass: DMatrix<f64>,
}

impl Dense {
    /// For five equal regions of a default tube, with tissue.
    pub(crate) fn new(n: usize, k_s: f64, c_s: f64) -> Self {
        let (dx, section) = (25.0 / n as f64, PI);
        let s = 2.0 * PI * dx;
        // Q = Q_in − C w.
        let c = DMatrix::from_fn(n, n, |i, j| if j <= i { s } else { 0.0 });
        let face = DMatrix::from_fn(n, n, |i, j| match i == j {
            true if i + 1 == n => 0.5 * dx,
            true => dx,
            false => 0.0,
        });
        let added = c.transpose() * &face * &c;
        let (l, friction) = (1.06 / section, 8.0 * PI * 0.035 / (section * section));
        let young = |j: usize| 5e6 * f64::exp2(OCTAVES[j * 5 / n]);
        let ring = |i: usize, _| s * (young(i) * 0.15 / (1.0 - 0.25) + k_s);
        let stiffness = DMatrix::from_diagonal(&DVector::from_fn(n, ring));
        let (r_p, r_d, compliance) = (150.0, 1850.0, 1e-3);
        let wall = DVector::from_element(n, s);
        let added_mass = l * &added;
        let mass = DMatrix::from_diagonal_element(n, n, s * 1.1 * 0.15) + &added_mass;
        let inverse = mass.try_inverse().unwrap();
        let damping = friction * &added
            + r_p * &wall * wall.transpose()
            + DMatrix::from_diagonal_element(n, n, s * (2e3 + c_s));
        let mut a = DMatrix::zeros(2 * n + 1, 2 * n + 1);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, n)).copy_from(&(-&inverse * stiffness));
        a.view_mut((n, n), (n, n)).copy_from(&(-&inverse * damping));
        a.view_mut((n, 2 * n), (n, 1)).copy_from(&(&inverse * &wall));
        a.view_mut((2 * n, n), (1, n)).copy_from(&(-wall.transpose() / compliance));
        a[(2 * n, 2 * n)] = -1.0 / (r_d * compliance);
        let load = c.transpose() * face * DVector::from_element(n, 1.0);
        let (mut inflow, mut slope) = (DVector::zeros(2 * n + 1), DVector::zeros(2 * n + 1));
        inflow.rows_mut(n, n).copy_from(&(&inverse * (r_p * &wall + friction * &load)));
        inflow[2 * n] = 1.0 / compliance;
        slope.rows_mut(n, n).copy_from(&(&inverse * (l * &load)));
        Self { a, inflow, slope, added_mass }
    }

    /// One step of the implicit midpoint rule.
    pub(crate) fn step(&self, x: &[f64], q: [f64; 2], dt: f64) -> DVector<f64> {
        let n = x.len();
        let half = 0.5 * dt * &self.a;
        let right = (DMatrix::identity(n, n) + &half) * DVector::from_column_slice(x)
            + 0.5 * dt * (q[0] + q[1]) * &self.inflow
            + (q[1] - q[0]) * &self.slope;
        (DMatrix::identity(n, n) - half).lu().solve(&right).unwrap()
    }

    /// dx/dt.
    pub(crate) fn rate(&self, x: &[f64], q: f64, slope: f64) -> DVector<f64> {
        &self.a * DVector::from_column_slice(x) + q * &self.inflow + slope * &self.slope
    }
}
