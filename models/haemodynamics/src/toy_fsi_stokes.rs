//! The toy fluid–structure system with a viscous fluid: a Stokes flow in a channel under a generalised string.
//!
//! The ends are free of traction, so sine modes of the wall decouple exactly: each is a wall amplitude b and a profile of the
//! flow with coefficients c, (Mf + m e eᵀ) dc/dt + D c + e k (b + τ eᵀ c) = 0, db/dt = eᵀ c, with the no-slip condition and the
//! divergence built into the profiles. Beside the waves of [`super::toy_fsi`] there are slow vortices that hardly move the
//! wall: no observer of the wall reaches them. States are the displacement at the nodes and the coefficients c, mode by mode.
//! Next file to read: [`super::toy_fsi::profiles`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, DVectorView};
use serde::{Deserialize, Serialize};
use starlings_models_core::blocks::Blocks;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, Quantity, Role, SetupError, Spec};

use super::toy_fsi::elements::Matrices;
use super::toy_fsi::layout::count;
use super::toy_fsi::profiles::{Fluid, Profiles};
use super::toy_fsi::propagator::Propagator;
use super::toy_fsi::spectral::Spectral;
use super::toy_fsi::vessel::{self, Vessel, wall_fields};
use super::toy_fsi::{WALL, bump, modal_matrices};
use starlings_models_core::cache::Cache;

/// A Stokes flow under a generalised string.
pub(crate) struct ToyFsiStokes {
    spec: Spec,
    spectral: Spectral,
    profiles: Profiles,
    modes: Cache<Vec<Mode>>,
}

/// `[model.layout]` of the model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Layout {
    /// Number of sine modes, and of nodes.
    pub modes: usize,
    /// Number of profiles of the flow across the channel in each mode.
    pub polynomials: usize,
}

impl Default for Layout {
    fn default() -> Self {
        Self { modes: 8, polynomials: 8 }
    }
}

/// One sine mode at given parameters; its unknowns are (b, c).
struct Mode {
    /// κR: the wall's velocity over the first coefficient.
    lever: f64,
    /// Rates of (b, c).
    rate: DMatrix<f64>,
    propagator: Propagator,
}

/// Number of parameters that [`Mode`] depends on; the height of the bump follows.
const N_SYSTEM: usize = Vessel::N + 1;

/// Mf + m e eᵀ and D + τ k e eᵀ: what the wall adds to the fluid at one wave number.
fn with_wall(vessel: &Vessel, mut fluid: Fluid, wave_number: f64) -> Fluid {
    let lever = wave_number * vessel.radius;
    fluid.mass[(0, 0)] += vessel.mass() * lever * lever;
    fluid.dissipation[(0, 0)] += vessel.retardation * vessel.stiffness(wave_number) * lever * lever;
    fluid
}

impl Mode {
    fn new(profiles: &Profiles, vessel: &Vessel, viscosity: f64, wave_number: f64) -> Self {
        let n = profiles.len() + 1;
        let lever = wave_number * vessel.radius;
        let root = vessel.stiffness(wave_number).sqrt();
        let Fluid { mass, dissipation } =
            with_wall(vessel, profiles.fluid(vessel, viscosity, wave_number), wave_number);
        let finite = mass.iter().all(|v| v.is_finite());
        let factor = if finite { mass.cholesky().map(|factor| factor.l()) } else { None };
        let lost = || DMatrix::from_element(n - 1, n - 1, f64::NAN);
        let factor = factor.unwrap_or_else(lost);
        let inverse = factor.solve_lower_triangular(&DMatrix::identity(n - 1, n - 1)).unwrap_or_else(lost);
        // In the energy coordinates √k b and Gᵀ c, with G Gᵀ the mass.
        let mut energetic = DMatrix::zeros(n, n);
        let wall = inverse.column(0) * (root * lever);
        energetic.view_mut((0, 1), (1, n - 1)).copy_from(&wall.transpose());
        energetic.view_mut((1, 0), (n - 1, 1)).copy_from(&-wall);
        energetic
            .view_mut((1, 1), (n - 1, n - 1))
            .copy_from(&-(&inverse * dissipation * inverse.transpose()));
        let (mut to, mut from) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        to[(0, 0)] = root;
        from[(0, 0)] = 1.0 / root;
        to.view_mut((1, 1), (n - 1, n - 1)).copy_from(&factor.transpose());
        from.view_mut((1, 1), (n - 1, n - 1)).copy_from(&inverse.transpose());
        let propagator = Propagator::new(energetic, to, from);
        Self { lever, rate: propagator.rate(), propagator }
    }
}

impl ToyFsiStokes {
    /// The model in a layout.
    ///
    /// # Errors
    /// When a number of the layout is out of range.
    pub(crate) fn new(layout: &Layout) -> Result<Self, SetupError> {
        let n = count("modes", layout.modes, 1)?;
        let n_b = count("polynomials", layout.polynomials, 1)?;
        count("modes", n * n_b, 1)?;
        let mut states = wall_fields(n);
        states[1] = Quantity::new("fluid", "cm/s")
            .size(n * n_b)
            .says("Coefficients of the axial velocity profiles, all of the first sine mode first.");
        let viscosity = Quantity::new("mu", "g/cm/s").range(0.0, f64::INFINITY).default(0.035);
        let parameters = Vessel::parameters()
            .into_iter()
            .chain([viscosity.role(Role::Damping).says("Viscosity of the fluid."), vessel::bump_parameter()]);
        let spec = Spec {
            kind: "toy-fsi-stokes".to_owned(),
            says: "A viscous flow in a channel under an elastic wall that vibrates freely.".to_owned(),
            states,
            parameters: parameters.collect(),
            outputs: wall_fields(n),
            inputs: Vec::new(),
            measures: vec![(WALL.displacement.to_owned(), WALL.displacement.to_owned())],
            restart: true,
        };
        let (spectral, profiles) = (Spectral::sines(n), Profiles::new(n_b));
        Ok(Self { spec, spectral, profiles, modes: Cache::default() })
    }

    /// Builds the model from a definition; with 8 modes of 8 profiles without a layout.
    ///
    /// # Errors
    /// When the layout is wrong.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&starlings_models_core::layout::read(def)?)?))
    }

    fn modes(&self, theta: &[f64]) -> Arc<Vec<Mode>> {
        self.modes.get(&theta[..N_SYSTEM], || {
            let vessel = Vessel::read(theta);
            let mode = |kappa| Mode::new(&self.profiles, &vessel, theta[Vessel::N], kappa);
            self.spectral.wave_numbers(vessel.length).into_iter().map(mode).collect()
        })
    }

    /// Nodal value of a sine of amplitude 1 over an entry of the orthonormal transform.
    fn peak(&self) -> f64 {
        ((self.spectral.len() + 1) as f64 / 2.0).sqrt()
    }

    /// Applies a matrix to the unknowns (b, c) of every mode; writes displacements and coefficients.
    fn each<'a>(&self, x: &[f64], matrix: impl Fn(usize) -> &'a DMatrix<f64>, out: &mut [f64]) {
        let (n, n_b) = (self.spectral.len(), self.profiles.len());
        let mut amplitudes = self.spectral.apply(&x[..n]) / self.peak();
        let mut unknowns = DVector::zeros(n_b + 1);
        for i in 0..n {
            let at = n + i * n_b;
            unknowns[0] = amplitudes[i];
            unknowns.rows_mut(1, n_b).copy_from(&DVectorView::from_slice(&x[at..at + n_b], n_b));
            let result = matrix(i) * &unknowns;
            amplitudes[i] = result[0];
            out[at..at + n_b].copy_from_slice(&result.as_slice()[1..]);
        }
        out[..n].copy_from_slice((self.spectral.apply(amplitudes.as_slice()) * self.peak()).as_slice());
    }
}

impl Model for ToyFsiStokes {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let (d, fluid) = x.split_at_mut(self.spectral.len());
        bump(self.spectral.nodes(), theta[N_SYSTEM], d);
        fluid.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        let modes = self.modes(theta);
        self.each(x, |i| &modes[i].rate, dx);
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        let (n, n_b, modes) = (self.spectral.len(), self.profiles.len(), self.modes(theta));
        let speeds: Vec<f64> =
            modes.iter().enumerate().map(|(i, mode)| mode.lever * x[n + i * n_b]).collect();
        y[..n].copy_from_slice(&x[..n]);
        y[n..].copy_from_slice((self.spectral.apply(&speeds) * self.peak()).as_slice());
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        let (vessel, viscosity) = (Vessel::read(theta), theta[Vessel::N]);
        let (n, n_b, kappa) =
            (self.spectral.len(), self.profiles.len(), self.spectral.wave_numbers(vessel.length));
        let Matrices { solid_mass, added_mass, stiffness } = modal_matrices(&self.spectral, &vessel);
        let (mut mass, mut trace) = (DMatrix::zeros(n * n_b, n * n_b), DMatrix::zeros(n, n * n_b));
        for (i, &kappa) in kappa.iter().enumerate() {
            let mode = with_wall(&vessel, self.profiles.fluid(&vessel, viscosity, kappa), kappa);
            // ∫ sin² κx dx is L/2.
            let block = mode.mass * (0.5 * vessel.length);
            mass.view_mut((i * n_b, i * n_b), (n_b, n_b)).copy_from(&block);
            let column = self.spectral.transform().column(i) * (self.peak() * kappa * vessel.radius);
            trace.set_column(i * n_b, &column);
        }
        Some(Blocks {
            displacement: 0,
            velocity: n,
            mass,
            trace: Some(trace),
            solid_mass,
            added_mass,
            stiffness,
            windkessel: None,
            outputs: WALL,
        })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let modes = self.modes(theta);
        let h = segment.t1 - segment.t0;
        let steps: Vec<_> = modes.iter().map(|mode| mode.propagator.step(h)).collect();
        let mut end = vec![0.0; x.len()];
        self.each(x, |i| &steps[i], &mut end);
        x.copy_from_slice(&end);
        Ok(())
    }
}
