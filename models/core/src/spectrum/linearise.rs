//! The linearisation A = ∂f/∂x of a model where its runs start, with inputs at rest.
//!
//! A model's own Jacobian where it has one, else central differences. A model that has no linearisation there is refused: one
//! that remembers its past, or one that switches within the step of the differences. Next file to read: [`super::pole`].

use nalgebra::{DMatrix, DVector};

use super::SpectrumError;
use crate::segment::History;
use crate::{Drive, Model, Spec};

/// A, n_state × n_state, at the model's initial state.
///
/// # Errors
/// When the model depends on its past, switches there, or its rate is not finite there.
pub fn linearisation(model: &dyn Model, theta: &[f64]) -> Result<DMatrix<f64>, SpectrumError> {
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(theta, &mut x);
    linearisation_at(model, theta, &x)
}

/// A, n_state × n_state, at the state `x`.
///
/// # Errors
/// When the model depends on its past, switches there, or its rate is not finite there.
pub(super) fn linearisation_at(
    model: &dyn Model,
    theta: &[f64],
    x: &[f64],
) -> Result<DMatrix<f64>, SpectrumError> {
    if !model.memories().is_empty() {
        return Err(SpectrumError::Delayed { model: model.spec().kind.clone() });
    }
    let rest = Rest::new(model.spec().inputs.iter().map(|q| q.size).sum());
    let at = Point { model, theta, drive: rest.drive() };
    if model.blocks(theta).is_some() && model.n_switch() == 0 {
        // A linear system: unit steps about rest make no error of differencing, whatever the units of the states. An effect
        // may have made it nonlinear.
        let about_rest = at.differences(&vec![0.0; x.len()], |_| 1.0);
        if let Some(a) = about_rest.ok().filter(|a| at.is_linear(a)) {
            return Ok(a);
        }
    }
    let n = x.len();
    let (mut a, mut dfdt) = (DMatrix::zeros(n, n), vec![0.0; n]);
    at.check_switches(x)?;
    if model.jacobian(0.0, x, theta, at.drive, a.as_mut_slice(), &mut dfdt) {
        return at.finite(a);
    }
    at.differences(x, |j| step(x[j]))
}

/// The step that balances the rounding and the truncation of a central difference at a value.
fn step(value: f64) -> f64 {
    f64::EPSILON.cbrt() * value.abs().max(1.0)
}

/// A model at given parameters and inputs.
struct Point<'a> {
    model: &'a dyn Model,
    theta: &'a [f64],
    drive: Drive<'a>,
}

impl Point<'_> {
    /// ∂f/∂x by central differences.
    fn differences(&self, x: &[f64], step: impl Fn(usize) -> f64) -> Result<DMatrix<f64>, SpectrumError> {
        let n = x.len();
        let (mut moved, mut up, mut down) = (x.to_vec(), vec![0.0; n], vec![0.0; n]);
        let mut a = DMatrix::zeros(n, n);
        for j in 0..n {
            let (above, below) = (x[j] + step(j), x[j] - step(j));
            moved[j] = above;
            self.model.rhs(0.0, &moved, self.theta, self.drive, &mut up);
            moved[j] = below;
            self.model.rhs(0.0, &moved, self.theta, self.drive, &mut down);
            moved[j] = x[j];
            for i in 0..n {
                a[(i, j)] = (up[i] - down[i]) / (above - below);
            }
        }
        self.finite(a)
    }

    /// Whether the odd part of the rate about rest is A x also for a state with all components.
    fn is_linear(&self, a: &DMatrix<f64>) -> bool {
        let n = a.nrows();
        let x = DVector::from_fn(n, |i, _| (i as f64 + 1.0).sin());
        let rate = |x: &DVector<f64>| {
            let mut dx = vec![0.0; n];
            self.model.rhs(0.0, x.as_slice(), self.theta, self.drive, &mut dx);
            DVector::from_vec(dx)
        };
        let odd = (rate(&x) - rate(&-&x)) * 0.5;
        let size = a.abs() * x.abs();
        let difference = odd - a * x;
        // Rounding of sums of n products, with room for a solver inside the rate.
        difference.iter().zip(size.iter()).all(|(d, s)| d.abs() <= 1e-8 * s)
    }

    /// Refuses a state from which a small step crosses a switch of the rate.
    fn check_switches(&self, x: &[f64]) -> Result<(), SpectrumError> {
        let n_switch = self.model.n_switch();
        let signs = |x: &[f64]| {
            let mut g = vec![0.0; n_switch];
            self.model.switches(0.0, x, self.theta, self.drive, &mut g);
            g.iter().map(|g| g.partial_cmp(&0.0)).collect::<Vec<_>>()
        };
        let mut moved = x.to_vec();
        for j in 0..x.len() {
            moved[j] = x[j] + step(x[j]);
            let above = signs(&moved);
            moved[j] = x[j] - step(x[j]);
            if above != signs(&moved) {
                return Err(SpectrumError::Switching { model: self.kind(), state: self.state(j) });
            }
            moved[j] = x[j];
        }
        Ok(())
    }

    /// Refuses a matrix that is not finite.
    fn finite(&self, a: DMatrix<f64>) -> Result<DMatrix<f64>, SpectrumError> {
        let bad = a.row_iter().position(|row| !row.iter().all(|v| v.is_finite()));
        match bad {
            Some(i) => Err(SpectrumError::NotFinite { model: self.kind(), state: self.state(i) }),
            None => Ok(a),
        }
    }

    fn kind(&self) -> String {
        self.model.spec().kind.clone()
    }

    fn state(&self, j: usize) -> String {
        Spec::component(&self.model.spec().states, j)
    }
}

/// Inputs that are zero and always were.
struct Rest {
    zeros: Vec<f64>,
}

impl Rest {
    fn new(n_input: usize) -> Self {
        Self { zeros: vec![0.0; n_input] }
    }

    fn drive(&self) -> Drive<'_> {
        Drive { value: &self.zeros, slope: &self.zeros, history: self }
    }
}

impl History for Rest {
    fn at(&self, _index: usize, _t: f64) -> f64 {
        0.0
    }
}
