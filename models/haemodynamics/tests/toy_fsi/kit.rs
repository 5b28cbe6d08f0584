//! A toy model at given parameters, its poles under an observer, and comparisons.

use nalgebra::{Complex, DMatrix, SymmetricEigen};
use serde_json::Value;
use starlings_haemodynamics::MODELS;
use starlings_models_core::observer::{self, Wiring};
use starlings_models_core::spectrum::ROUNDING;
use starlings_models_core::spectrum::{
    Best, Feedback, GainCurve, ObservedSystem, linearisation, natural, poles, slopes,
};
use starlings_models_core::{Blocks, Model, ModelDef, NativeModels, Observer, ObserverDef, SetupError};

/// Set A of the tables, a large artery, is the default of all models; set B is softer, thinner and shorter.
pub(crate) const SOFT: [(&str, f64); 5] = [("L", 5.0), ("R", 0.5), ("h", 0.1), ("E", 7.5e5), ("rho_f", 1.0)];

const NATIVE: NativeModels = NativeModels::of(&[MODELS]);

/// A model, its parameters, and what is observed.
pub(crate) struct Toy {
    pub(crate) model: Box<dyn Model>,
    pub(crate) theta: Vec<f64>,
    outputs: Vec<String>,
}

/// Stands for the Windkessel observer of the theory, to which the stored pressure is known.
pub(crate) const STORED_PRESSURE: &str = "stored pressure";

fn def(kind: &str, gain: f64) -> ObserverDef {
    ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() }
}

/// Builds a kind in a layout.
pub(crate) fn build(kind: &str, layout: Value) -> Result<Box<dyn Model>, SetupError> {
    let native = NATIVE.find(kind).unwrap();
    (native.build)(&ModelDef { kind: kind.to_owned(), layout: Some(layout), ..ModelDef::default() })
}

impl Toy {
    /// The kind in a layout, with some parameters changed, all outputs observed.
    pub(crate) fn new(kind: &str, layout: Value, changed: &[(&str, f64)]) -> Self {
        let model = build(kind, layout).unwrap();
        let value = |q: &starlings_models_core::Quantity| {
            let own = changed.iter().find(|(name, _)| *name == q.name);
            own.map_or_else(|| q.default.unwrap(), |(_, value)| *value)
        };
        let theta = model.spec().parameters.iter().map(value).collect();
        let outputs = model.spec().outputs.iter().map(|q| q.name.clone()).collect();
        Self { model, theta, outputs }
    }

    /// The same with only the first `n` nodes of the wall observed.
    pub(crate) fn observing(mut self, n: usize) -> Self {
        let fields = ["displacement", "velocity"].into_iter();
        self.outputs = fields.flat_map(|field| (0..n).map(move |i| format!("{field}[{i}]"))).collect();
        self
    }

    pub(crate) fn blocks(&self) -> Blocks {
        self.model.blocks(&self.theta).unwrap()
    }

    pub(crate) fn linearisation(&self) -> DMatrix<f64> {
        linearisation(&*self.model, &self.theta).unwrap()
    }

    pub(crate) fn observer(&self, kind: &str, gain: f64) -> Box<dyn Observer> {
        observer::build(&def(kind, gain), self.wiring()).unwrap()
    }

    fn wiring(&self) -> Wiring<'_> {
        let (spec, outputs) = (self.model.spec(), &self.outputs);
        Wiring { spec, outputs, model: &*self.model, theta: &self.theta, native: NATIVE }
    }

    /// Γ in the state's coordinates; under `stored pressure` that of the Windkessel observer if π itself were measured.
    pub(crate) fn feedback(&self, kind: &str, gain: f64) -> DMatrix<f64> {
        if kind == STORED_PRESSURE {
            // γ/(R_d C) on π alone: R_p Q of the true flow is taken off the measured pressure.
            let block = self.model.blocks(&self.theta).unwrap().windkessel.unwrap();
            let n = self.model.spec().n_state();
            let mut feedback = DMatrix::zeros(n, n);
            feedback[(block.state, block.state)] = gain * block.rate;
            return feedback;
        }
        self.observer(kind, gain).feedback(&*self.model, &self.theta)
    }

    /// A matrix in energy coordinates, where eigenvalues are found most exactly.
    pub(crate) fn natural(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        natural(&*self.model, &self.theta, matrix)
    }

    pub(crate) fn poles(&self) -> Vec<Complex<f64>> {
        poles(&self.natural(&self.linearisation())).unwrap()
    }

    /// The error of the state under an observer, for any gain.
    pub(crate) fn system(&self, kind: &str) -> ObservedSystem {
        let at = |gain: f64| Ok::<_, SetupError>(self.natural(&self.feedback(kind, gain)));
        let feedback = Feedback::of(at).unwrap().unwrap();
        ObservedSystem::new(&self.natural(&self.linearisation()), &feedback, ROUNDING).unwrap()
    }

    /// Compares the largest real parts at several gains with a row of a table.
    pub(crate) fn holds_max_re(&self, kind: &str, gains: &[f64], table: &[f64], tolerance: f64) {
        let system = self.system(kind);
        assert_eq!(gains.len(), table.len());
        for (&gain, &expected) in gains.iter().zip(table) {
            let found = system.max_re(gain).unwrap();
            assert!((found - expected).abs() <= tolerance, "{kind} at {gain}: {found:.9} for {expected}");
        }
    }

    /// ∂λ/∂γ of given poles; the differences of the poles must agree with the eigenvectors.
    pub(crate) fn slopes(&self, kind: &str, of: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let both = slopes(&self.system(kind), of).unwrap();
        let one = both.into_iter().map(|slope| {
            let (analytic, numerical) = (slope.analytic.unwrap(), slope.numerical.unwrap());
            let difference = (analytic - numerical).norm();
            // A difference of the fourth order at a five-thousandth of the pole.
            assert!(difference < 1e-8, "{kind}: {analytic} and {numerical} by differences");
            analytic
        });
        one.collect()
    }

    pub(crate) fn best(&self, kind: &str) -> Best {
        let system = self.system(kind);
        GainCurve::scan(&system).unwrap().best(&system).unwrap()
    }

    /// The smallest gain for a largest real part.
    pub(crate) fn gain_for(&self, kind: &str, max_re: f64) -> f64 {
        let system = self.system(kind);
        let curve = GainCurve::scan(&system).unwrap();
        let best = curve.best(&system).unwrap();
        curve.gain_for(&system, best, max_re).unwrap().unwrap()
    }
}

/// ω in ascending order and the modes Φ with Φᵀ M Φ = 1, of K Φ = M Φ ω².
pub(crate) fn vibration(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let inverse = mass.clone().cholesky().unwrap().l().try_inverse().unwrap();
    let eigen = SymmetricEigen::new(&inverse * stiffness * inverse.transpose());
    let mut order: Vec<usize> = (0..mass.nrows()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let omega = order.iter().map(|&i| eigen.eigenvalues[i].sqrt()).collect();
    (omega, inverse.transpose() * eigen.eigenvectors.select_columns(&order))
}

/// Compares number by number within an absolute tolerance.
pub(crate) fn close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert!(found.len() >= expected.len(), "{what}: {found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{what}: {found:.12} for {expected}");
    }
}

/// Compares number by number within a relative tolerance.
pub(crate) fn close_relative(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert!(found.len() >= expected.len(), "{what}: {found:?}");
    for (found, expected) in found.iter().zip(expected) {
        let off = (found / expected - 1.0).abs();
        assert!(off <= tolerance, "{what}: {found:.12} for {expected}, off by {off:.1e}");
    }
}

/// The pole nearest to a value.
pub(crate) fn nearest(poles: &[Complex<f64>], to: Complex<f64>) -> Complex<f64> {
    poles.iter().copied().min_by(|p, q| (p - to).norm().total_cmp(&(q - to).norm())).unwrap()
}
