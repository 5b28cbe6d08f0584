//! Linear fluid–structure systems written out as matrices: what spectra are tested on.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use starlings_models::blocks::{Blocks, WallOutputs, WindkesselBlock};
use starlings_models::{Drive, Model, Quantity, Spec};
use std::f64::consts::PI;

/// (Ms + MA) dv/dt + K d = S p, dd/dt = v; where there is a Windkessel, p = −(R_p Q + π) and C dπ/dt = Q − π/R_d with
/// Q = Sᵀ v, and a negative `flow` says that the wall's volume flows out.
pub(crate) struct Structure {
    spec: Spec,
    solid: DMatrix<f64>,
    added: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    rate: DMatrix<f64>,
    windkessel: Option<WindkesselBlock>,
}

impl Structure {
    fn new(
        solid: DMatrix<f64>,
        added: DMatrix<f64>,
        stiffness: DMatrix<f64>,
        outlet: Option<Outlet>,
    ) -> Self {
        let n = solid.nrows();
        let inverse = (&solid + &added).try_inverse().expect("mass");
        let size = 2 * n + usize::from(outlet.is_some());
        let mut rate = DMatrix::zeros(size, size);
        rate.view_mut((0, n), (n, n)).fill_with_identity();
        rate.view_mut((n, 0), (n, n)).copy_from(&(-&inverse * &stiffness));
        let mut states = vec![Quantity::new("d", "cm").size(n), Quantity::new("v", "cm/s").size(n)];
        let mut outputs =
            vec![Quantity::new("displacement", "cm").size(n), Quantity::new("velocity", "cm/s").size(n)];
        outputs.push(Quantity::new("pressure", "dyn/cm^2"));
        if let Some(Outlet { s, r_p, r_d, c }) = &outlet {
            rate.view_mut((n, n), (n, n)).copy_from(&(-&inverse * s * s.transpose() * *r_p));
            rate.view_mut((n, 2 * n), (n, 1)).copy_from(&(&inverse * s));
            rate.view_mut((2 * n, n), (1, n)).copy_from(&(-s.transpose() / *c));
            rate[(2 * n, 2 * n)] = -1.0 / (r_d * c);
            states.push(Quantity::new("pi", "dyn/cm^2"));
        }
        let windkessel = outlet.map(|o| WindkesselBlock { state: 2 * n, rate: 1.0 / (o.r_d * o.c) });
        let spec = Spec {
            kind: "structure".to_owned(),
            says: String::new(),
            states,
            parameters: Vec::new(),
            outputs,
            inputs: Vec::new(),
            measures: Vec::new(),
            restart: true,
        };
        Self { spec, solid, added, stiffness, rate, windkessel }
    }

    /// Frequency and shape of every mode, slowest first; the shapes have unit modal mass.
    pub(crate) fn modes(&self) -> Vec<(f64, DVector<f64>)> {
        let lower = (&self.solid + &self.added).cholesky().expect("positive definite").l();
        let inverse = lower.try_inverse().expect("regular");
        let eigen = SymmetricEigen::new(&inverse * &self.stiffness * inverse.transpose());
        let shape = |i: usize| inverse.transpose() * eigen.eigenvectors.column(i);
        let mut modes: Vec<_> =
            eigen.eigenvalues.iter().enumerate().map(|(i, square)| (square.sqrt(), shape(i))).collect();
        modes.sort_by(|p, q| p.0.total_cmp(&q.0));
        modes
    }

    /// ∂λ/∂γ of a mode by its quotient, with the nodes `seen` observed.
    pub(crate) fn slope(&self, kind: &str, omega: f64, mode: &DVector<f64>, seen: &[usize]) -> f64 {
        let n = mode.len();
        let hidden: Vec<usize> = (0..n).filter(|i| !seen.contains(i)).collect();
        let mut on_seen = DVector::zeros(n);
        for &i in seen {
            on_seen[i] = mode[i];
        }
        let part =
            |rows: &[usize], columns: &[usize]| self.stiffness.select_rows(rows).select_columns(columns);
        let mut extension = on_seen.clone();
        if !hidden.is_empty() {
            let load = part(&hidden, seen) * mode.select_rows(seen);
            let values = part(&hidden, &hidden).lu().solve(&load).expect("regular");
            for (&i, value) in hidden.iter().zip(values.iter()) {
                extension[i] = -value;
            }
        }
        match kind {
            "dvf" => -0.5 * on_seen.dot(&(&self.solid * &on_seen)),
            "dvf-am" => -0.5 * on_seen.dot(&((&self.solid + &self.added) * &on_seen)),
            "sdf" => -0.5 * mode.dot(&(&self.stiffness * &extension)) / (omega * omega),
            _ => -0.5 * mode.dot(&(&self.solid * &extension)),
        }
    }
}

impl Model for Structure {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(0.25);
    }

    fn rhs(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        dx.copy_from_slice((&self.rate * DVector::from_column_slice(x)).as_slice());
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        let n = self.solid.nrows();
        y[..2 * n].copy_from_slice(&x[..2 * n]);
        y[2 * n] = x.get(2 * n).copied().unwrap_or_default();
    }

    fn blocks(&self, _theta: &[f64]) -> Option<Blocks> {
        Some(Blocks {
            displacement: 0,
            velocity: self.solid.nrows(),
            mass: &self.solid + &self.added,
            trace: None,
            solid_mass: self.solid.clone(),
            added_mass: self.added.clone(),
            stiffness: self.stiffness.clone(),
            windkessel: self.windkessel,
            outputs: WallOutputs {
                displacement: "displacement",
                velocity: "velocity",
                pressure: self.windkessel.map(|_| "pressure"),
            },
        })
    }
}

/// A Windkessel and the volume that it takes from each displacement.
struct Outlet {
    s: DVector<f64>,
    r_p: f64,
    r_d: f64,
    c: f64,
}

/// Solid mass, added masses and stiffnesses of the modes of an artery of 10 cm with these wave numbers, per unit of depth
/// (cm, g, s).
fn artery(kappa: &[f64]) -> (f64, Vec<f64>, Vec<f64>) {
    let (h, e, density, fluid) = (0.15, 5e6, 1.1, 1.06);
    let (a, b) = (e * h / 0.75, 5.0 / 6.0 * e / 3.0 * h);
    let added = kappa.iter().map(|k| fluid / (k * k.tanh())).collect();
    (density * h, added, kappa.iter().map(|k| a + b * k * k).collect())
}

fn diagonal(values: &[f64], factor: f64) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_column_slice(values)) * factor
}

/// `n` sine modes of the artery.
pub(crate) fn artery_modes(n: usize) -> Structure {
    let kappa: Vec<f64> = (1..=n).map(|i| i as f64 * PI / 10.0).collect();
    let (solid, added, stiffness) = artery(&kappa);
    Structure::new(diagonal(&vec![solid; n], 1.0), diagonal(&added, 1.0), diagonal(&stiffness, 1.0), None)
}

/// `n` quarter-wave modes of the artery, 2π deep, with a closed inlet and a Windkessel at the outlet.
pub(crate) fn artery_windkessel(n: usize) -> Structure {
    let kappa: Vec<f64> = (0..n).map(|i| (i as f64 + 0.5) * PI / 10.0).collect();
    let (solid, added, stiffness) = artery(&kappa);
    let depth = 2.0 * PI;
    let s = DVector::from_iterator(n, kappa.iter().map(|k| depth * 0.2_f64.sqrt() * (10.0 * k).sin() / k));
    Structure::new(
        diagonal(&vec![solid; n], depth),
        diagonal(&added, depth),
        diagonal(&stiffness, depth),
        Some(Outlet { s, r_p: 150.0, r_d: 1850.0, c: 1e-3 }),
    )
}

/// `n` different masses on springs, each moving fluid that its neighbours feel.
pub(crate) fn chain(n: usize) -> Structure {
    let solid = DMatrix::from_fn(n, n, |i, j| if i == j { 0.2 + 0.03 * i as f64 } else { 0.0 });
    let added = DMatrix::from_fn(n, n, |i, j| 1.5 * (-0.7 * (i as f64 - j as f64).abs()).exp());
    let stiffness = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => 4e4 + 3e3 * i as f64,
        1 => -1.5e4,
        _ => 0.0,
    });
    Structure::new(solid, added, stiffness, None)
}
