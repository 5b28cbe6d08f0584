//! A wall with dense random matrices: no symmetry, commutation or sparsity that a wrong formula could hide behind.
#![allow(clippy::unwrap_used, dead_code, reason = "test helpers; each test binary uses its part")]

use nalgebra::{DMatrix, DVector};
use starlings_models_core::blocks::{Blocks, WallOutputs, WindkesselBlock};
use starlings_models_core::observer::{self, Correction, Observer, Wiring};
use starlings_models_core::{Drive, Model, NativeModels, ObserverDef, Quantity, SetupError, Spec};

/// Number of wall nodes.
pub(crate) const N: usize = 6;

/// The gain of most tests.
pub(crate) const GAIN: f64 = 1.7;

/// Observers of the wall itself.
pub(crate) const STRUCTURAL: [&str; 5] = ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"];

/// States: π, then d, then c; outputs: pressure, velocity, displacement, in an order of their own.
pub(crate) struct DenseWall {
    pub(crate) blocks: Blocks,
    pub(crate) damping: DMatrix<f64>,
    /// R_p ∂Q/∂c, one row: the pressure output is π + R_p Q.
    pub(crate) outflow: DMatrix<f64>,
    spec: Spec,
}

/// Numbers in (−1, 1) that look random (Lehmer's generator).
pub(crate) fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
    let mut s = seed * 2 + 1;
    DMatrix::from_fn(rows, columns, |_, _| {
        s = s * 48_271 % 2_147_483_647;
        s as f64 / 1_073_741_823.5 - 1.0
    })
}

/// A symmetric matrix with eigenvalues above `floor`.
fn positive(n: usize, seed: u64, floor: f64) -> DMatrix<f64> {
    let a = random(n, n, seed);
    a.tr_mul(&a) + DMatrix::identity(n, n) * floor
}

impl DenseWall {
    /// Undamped, the velocity unknowns being the wall velocity: M = Ms + MA.
    pub(crate) fn potential() -> Self {
        let (solid, added) = (positive(N, 11, 0.5), positive(N, 12, 0.2) * 2.0);
        Self::new(&solid + &added, None, solid, added, DMatrix::zeros(N, N))
    }

    /// Nine velocity unknowns behind the wall velocity, damped.
    pub(crate) fn viscous() -> Self {
        let (solid, added) = (positive(N, 21, 0.5), positive(N, 22, 0.2));
        let trace = random(N, 9, 23);
        let mass = positive(9, 24, 0.3) + trace.tr_mul(&solid) * &trace;
        Self::new(mass, Some(trace), solid, added, positive(9, 25, 0.1))
    }

    fn new(
        mass: DMatrix<f64>,
        trace: Option<DMatrix<f64>>,
        solid_mass: DMatrix<f64>,
        added_mass: DMatrix<f64>,
        damping: DMatrix<f64>,
    ) -> Self {
        let (mut states, mut outputs) = (vec![Quantity::new("pi", "")], vec![Quantity::new("pressure", "")]);
        states.extend([Quantity::new("d", "").size(N), Quantity::new("c", "").size(mass.nrows())]);
        outputs.extend([Quantity::new("velocity", "").size(N), Quantity::new("displacement", "").size(N)]);
        let (kind, says) = ("dense-wall".to_owned(), "A wall.".to_owned());
        let (parameters, inputs, measures) = (vec![], vec![], vec![]);
        let spec = Spec { kind, says, states, parameters, outputs, inputs, measures, restart: true };
        let outflow = random(1, mass.nrows(), 31);
        let blocks = Blocks {
            displacement: 1,
            velocity: 1 + N,
            mass,
            trace,
            solid_mass,
            added_mass,
            stiffness: positive(N, 13, 1.0) * 4.0,
            windkessel: Some(WindkesselBlock { state: 0, rate: 0.7 }),
            outputs: WallOutputs {
                displacement: "displacement",
                velocity: "velocity",
                pressure: Some("pressure"),
            },
        };
        Self { blocks, damping, outflow, spec }
    }

    /// E, the identity where the velocity unknowns are the wall velocity.
    pub(crate) fn trace(&self) -> DMatrix<f64> {
        self.blocks.trace.clone().unwrap_or_else(|| DMatrix::identity(N, N))
    }

    /// A, the model's own linearisation.
    pub(crate) fn rate(&self) -> DMatrix<f64> {
        let n = self.spec.n_state();
        let mut a = DMatrix::zeros(n, n);
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            self.rhs(0.0, &unit, &[], Drive::NONE, a.column_mut(j).as_mut_slice());
        }
        a
    }

    /// The outputs as the rows of every channel of `channels`.
    pub(crate) fn show(&self, channels: &[String], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.spec.n_output()];
        self.output(0.0, x, &[], Drive::NONE, &mut y);
        channels.iter().flat_map(|c| y[Spec::range_of(&self.spec.outputs, c).unwrap()].to_vec()).collect()
    }

    /// Builds an observer on the channels.
    pub(crate) fn observer(&self, kind: &str, gain: f64, channels: &[String]) -> Box<dyn Observer> {
        self.try_observer(kind, gain, channels).unwrap()
    }

    /// Builds an observer on the channels, or says why not.
    pub(crate) fn try_observer(
        &self,
        kind: &str,
        gain: f64,
        channels: &[String],
    ) -> Result<Box<dyn Observer>, SetupError> {
        let def = ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() };
        observer::build(
            &def,
            Wiring {
                spec: &self.spec,
                outputs: channels,
                model: self,
                theta: &[],
                native: NativeModels::NONE,
            },
        )
    }

    /// The state after one correction by `observed`.
    pub(crate) fn corrected(
        &self,
        observer: &dyn Observer,
        dt: f64,
        channels: &[String],
        observed: &[f64],
        x: &[f64],
    ) -> Vec<f64> {
        let predicted = self.show(channels, x);
        let mut x = x.to_vec();
        let spans = vec![dt; observed.len()];
        let at =
            Correction { t: dt, spans: &spans, observed, predicted: &predicted, model: self, theta: &[] };
        observer.correct(at, &mut x);
        x
    }

    /// Γ of an observer.
    pub(crate) fn feedback(&self, kind: &str, gain: f64, channels: &[String]) -> DMatrix<f64> {
        self.observer(kind, gain, channels).feedback(self, &[])
    }
}

impl Model for DenseWall {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        let d = DVector::from_column_slice(&x[1..=N]);
        let c = DVector::from_column_slice(&x[1 + N..]);
        let force = self.trace().tr_mul(&(&self.blocks.stiffness * d)) + &self.damping * &c;
        dx[0] = -0.7 * x[0];
        dx[1..=N].copy_from_slice((self.trace() * c).as_slice());
        dx[1 + N..].copy_from_slice((-self.blocks.mass.clone().lu().solve(&force).unwrap()).as_slice());
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        let velocity = DVector::from_column_slice(&x[1 + N..]);
        y[0] = x[0] + (&self.outflow * &velocity)[0];
        let wall = self.trace() * velocity;
        y[1..=N].copy_from_slice(wall.as_slice());
        y[1 + N..].copy_from_slice(&x[1..=N]);
    }

    fn blocks(&self, _theta: &[f64]) -> Option<Blocks> {
        Some(self.blocks.clone())
    }
}

/// Names as channels.
pub(crate) fn channels(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// Eigenvalues, sorted by imaginary, then real part.
pub(crate) fn poles(a: &DMatrix<f64>) -> Vec<(f64, f64)> {
    let mut poles: Vec<(f64, f64)> = a.complex_eigenvalues().iter().map(|z| (z.im, z.re)).collect();
    poles.sort_by(|a, b| a.partial_cmp(b).unwrap());
    poles
}

/// Channels that show nodes 0, 2 and 5, of displacement and of velocity.
pub(crate) fn half() -> Vec<String> {
    channels(&[
        "velocity[5]",
        "displacement[2]",
        "velocity[0]",
        "displacement[5]",
        "displacement[0]",
        "velocity[2]",
    ])
}

/// Channels that show everything of the wall.
pub(crate) fn full() -> Vec<String> {
    channels(&["displacement", "velocity"])
}

/// H of `half`.
pub(crate) fn h() -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.0, 1.0, 0.0, 0.0, 1.0]))
}

/// Ext by the definition, for H of `half`: the least elastic energy from its stationarity, all unknowns at once.
pub(crate) fn ext(stiffness: &DMatrix<f64>) -> DMatrix<f64> {
    let (one, h) = (DMatrix::identity(N, N), h());
    // Rows of observed nodes: Ext = 1; of the others: K Ext = 0.
    (&h + (&one - &h) * stiffness).lu().solve(&h).unwrap()
}
