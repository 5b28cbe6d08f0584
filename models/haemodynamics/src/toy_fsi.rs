//! The toy fluid–structure system: a potential flow in a channel under a generalised string, vibrating freely.
//!
//! (Ms + MA) d²d/dt² + τ K dd/dt + K d = 0 with the added mass MA of an incompressible inviscid fluid (Causin, Gerbeau &
//! Nobile 2005), by sine modes or by finite elements; states and outputs are the displacement and the velocity of the wall at
//! its nodes. No input, no viscosity, no outlet: [`super::toy_fsi_stokes`] and [`super::toy_fsi_windkessel`] have those. Next
//! file to read: [`vessel`], then [`vibration`].

pub(crate) mod elements;
pub(super) mod layout;
pub(crate) mod profiles;
pub(crate) mod propagator;
pub(crate) mod spectral;
pub(crate) mod vessel;
mod vibration;

use std::sync::Arc;

use starlings_models_core::blocks::{Blocks, WallOutputs};
use starlings_models_core::cache::Cache;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, SetupError, Spec};

use elements::Matrices;
use layout::{Discretisation, Layout};
use spectral::Spectral;
use vessel::Vessel;
use vibration::Vibration;

/// The outputs that show the wall in every toy model.
pub(crate) const WALL: WallOutputs =
    WallOutputs { displacement: "displacement", velocity: "velocity", pressure: None };

/// A potential flow under a generalised string.
pub(crate) struct ToyFsi {
    spec: Spec,
    discretisation: Discretisation,
    vibrations: Cache<Vibration>,
    matrices: Cache<Matrices>,
}

impl ToyFsi {
    /// The model in a layout.
    ///
    /// # Errors
    /// When a number of the layout is out of range or belongs to the other discretisation.
    pub(crate) fn new(layout: &Layout) -> Result<Self, SetupError> {
        let discretisation = layout.check()?;
        let n = match &discretisation {
            Discretisation::Modes(spectral) => spectral.len(),
            Discretisation::Elements(elements) => elements.len(),
        };
        let same = |name: &str| (name.to_owned(), name.to_owned());
        let spec = Spec {
            kind: "toy-fsi".to_owned(),
            says: "A potential flow in a channel under an elastic wall that vibrates freely.".to_owned(),
            states: vessel::wall_fields(n),
            parameters: Vessel::parameters().into_iter().chain([vessel::bump_parameter()]).collect(),
            outputs: vessel::wall_fields(n),
            inputs: Vec::new(),
            measures: vec![same(WALL.displacement), same(WALL.velocity)],
            restart: true,
        };
        Ok(Self { spec, discretisation, vibrations: Cache::default(), matrices: Cache::default() })
    }

    /// Builds the model from a definition; by 40 sine modes without a layout.
    ///
    /// # Errors
    /// When the layout is wrong.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&starlings_models_core::layout::read(def)?)?))
    }

    /// Number of nodes.
    fn n(&self) -> usize {
        self.spec.states[0].size
    }

    fn matrices(&self, theta: &[f64]) -> Arc<Matrices> {
        let vessel = Vessel::read(theta);
        self.matrices.get(&theta[..Vessel::N], || match &self.discretisation {
            Discretisation::Modes(spectral) => modal_matrices(spectral, &vessel),
            Discretisation::Elements(elements) => elements.matrices(&vessel),
        })
    }

    fn vibration(&self, theta: &[f64]) -> Arc<Vibration> {
        let vessel = Vessel::read(theta);
        self.vibrations.get(&theta[..Vessel::N], || match &self.discretisation {
            Discretisation::Modes(spectral) => {
                let square =
                    |kappa: f64| vessel.stiffness(kappa) / (vessel.mass() + vessel.added_mass(kappa));
                let squares = spectral.wave_numbers(vessel.length).into_iter().map(square).collect();
                Vibration::orthonormal(spectral.transform(), squares, vessel.retardation)
            }
            Discretisation::Elements(_) => {
                let matrices = self.matrices(theta);
                let mass = &matrices.solid_mass + &matrices.added_mass;
                Vibration::of(&mass, &matrices.stiffness, vessel.retardation)
            }
        })
    }
}

/// The nodal matrices of operators that are diagonal in the modes, per length of wall.
pub(crate) fn modal_matrices(spectral: &Spectral, vessel: &Vessel) -> Matrices {
    let spacing = spectral.spacing(vessel.length);
    let kappa = spectral.wave_numbers(vessel.length);
    Matrices {
        solid_mass: nalgebra::DMatrix::from_diagonal_element(
            spectral.len(),
            spectral.len(),
            spacing * vessel.mass(),
        ),
        added_mass: spectral.operator(|i| spacing * vessel.added_mass(kappa[i])),
        stiffness: spectral.operator(|i| spacing * vessel.stiffness(kappa[i])),
    }
}

/// Writes the initial displacement at the nodes.
pub(crate) fn bump(nodes: impl Iterator<Item = f64>, height: f64, d: &mut [f64]) {
    d.iter_mut().zip(nodes).for_each(|(d, xi)| *d = vessel::bump(height, xi));
}

impl Model for ToyFsi {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let (d, v) = x.split_at_mut(self.n());
        match &self.discretisation {
            Discretisation::Modes(spectral) => bump(spectral.nodes(), theta[Vessel::N], d),
            Discretisation::Elements(elements) => bump(elements.nodes(), theta[Vessel::N], d),
        }
        v.fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        let (d, v) = x.split_at(self.n());
        let (rate, acceleration) = dx.split_at_mut(self.n());
        rate.copy_from_slice(v);
        self.vibration(theta).acceleration(d, v, acceleration);
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y.copy_from_slice(x);
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        let Matrices { solid_mass, added_mass, stiffness } = (*self.matrices(theta)).clone();
        Some(Blocks {
            displacement: 0,
            velocity: self.n(),
            mass: &solid_mass + &added_mass,
            trace: None,
            solid_mass,
            added_mass,
            stiffness,
            windkessel: None,
            outputs: WALL,
        })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let (d, v) = x.split_at_mut(self.n());
        self.vibration(theta).advance(segment.t1 - segment.t0, d, v);
        Ok(())
    }
}
