//! The toy fluid–structure system between a pump and a Windkessel: the smallest model of an artery with its periphery.
//!
//! A flow Q_in enters at x = 0; at x = L the pressure is p = π + R_p Q with the three-element Windkessel C dπ/dt = Q − π/R_d
//! (Westerhof 1969) and the outflow Q = Q_in − Sᵀ w, S w being the volume that the wall gives way to. The wall obeys
//! (Ms + MA) dw/dt + K (d + τ w) = S p + F dQ_in/dt; F is the pressure that accelerates the entering flow. By quarter-wave
//! cosines, so the pressure of the modes vanishes at the outlet and their flow at the inlet. Next file to read:
//! [`super::toy_fsi::propagator`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use starlings_models_core::blocks::{Blocks, WallOutputs, WindkesselBlock};
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, Quantity, Role, SetupError, Spec};

use super::toy_fsi::layout::count;
use super::toy_fsi::propagator::Propagator;
use super::toy_fsi::spectral::Spectral;
use super::toy_fsi::vessel::{Vessel, wall_fields};
use super::toy_fsi::{WALL, modal_matrices};
use starlings_models_core::cache::Cache;

/// A channel under an elastic wall, from a known inflow to a Windkessel.
pub(crate) struct ToyFsiWindkessel {
    spec: Spec,
    spectral: Spectral,
    systems: Cache<System>,
}

/// `[model.layout]` of the model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Layout {
    /// Number of quarter-wave modes, and of nodes.
    pub modes: usize,
}

impl Default for Layout {
    fn default() -> Self {
        Self { modes: 20 }
    }
}

/// The model at given parameters, in the orthonormal amplitudes of the nodal values.
struct System {
    /// Diagonal of Ms + MA.
    mass: DVector<f64>,
    /// Diagonal of K.
    stiffness: DVector<f64>,
    /// S.
    coupling: DVector<f64>,
    /// F.
    entry: DVector<f64>,
    vessel: Vessel,
    outlet: Outlet,
    /// Exact steps of (amplitudes, speeds, π, Q_in, dQ_in/dt).
    propagator: Propagator,
}

/// The Windkessel.
#[derive(Clone, Copy)]
struct Outlet {
    proximal: f64,
    distal: f64,
    compliance: f64,
}

/// Number of parameters that [`System`] depends on; the initial pressure follows.
const N_SYSTEM: usize = Vessel::N + 3;

/// The perimeter of the wall 2πR, which makes forces of pressures: the depth of the planar channel.
fn depth(vessel: &Vessel) -> f64 {
    std::f64::consts::TAU * vessel.radius
}

impl System {
    fn new(spectral: &Spectral, theta: &[f64]) -> Self {
        let vessel = Vessel::read(theta);
        let outlet = Outlet {
            proximal: theta[Vessel::N],
            distal: theta[Vessel::N + 1],
            compliance: theta[Vessel::N + 2],
        };
        let (n, depth, spacing) = (spectral.len(), depth(&vessel), spectral.spacing(vessel.length));
        let kappa = spectral.wave_numbers(vessel.length);
        let diagonal = |of: &dyn Fn(f64) -> f64| DVector::from_fn(n, |i, _| of(kappa[i]));
        let mass = diagonal(&|k| spacing * depth * (vessel.mass() + vessel.added_mass(k)));
        let stiffness = diagonal(&|k| spacing * depth * vessel.stiffness(k));
        // ∫ √(2/L) cos κx dx and ∫ (L − x) √(2/L) cos κx dx, for amplitudes of nodal values.
        let scale = (spacing * 2.0 / vessel.length).sqrt();
        let coupling = diagonal(&|k| depth * scale * (k * vessel.length).sin() / k);
        let entry = diagonal(&|k| vessel.fluid_density / vessel.radius * scale / (k * k));
        let propagator = energetic(&mass, &stiffness, &coupling, &entry, vessel.retardation, outlet);
        Self { mass, stiffness, coupling, entry, vessel, outlet, propagator }
    }

    /// Q, the flow into the Windkessel.
    fn outflow(&self, speeds: &DVector<f64>, inflow: f64) -> f64 {
        inflow - self.coupling.dot(speeds)
    }
}

/// The system in the energy coordinates √K a, √M b, √C π, followed by the inflow and its slope, which the segment holds.
fn energetic(
    mass: &DVector<f64>,
    stiffness: &DVector<f64>,
    coupling: &DVector<f64>,
    entry: &DVector<f64>,
    retardation: f64,
    outlet: Outlet,
) -> Propagator {
    let n = mass.len();
    let (pi, inflow, slope) = (2 * n, 2 * n + 1, 2 * n + 2);
    let Outlet { proximal, distal, compliance } = outlet;
    let mut b = DMatrix::zeros(2 * n + 3, 2 * n + 3);
    let root = mass.map(f64::sqrt);
    let s = coupling.component_div(&root);
    for i in 0..n {
        let omega = (stiffness[i] / mass[i]).sqrt();
        b[(i, n + i)] = omega;
        b[(n + i, i)] = -omega;
        for j in 0..n {
            b[(n + i, n + j)] = -proximal * s[i] * s[j];
        }
        b[(n + i, n + i)] -= retardation * omega * omega;
        b[(n + i, pi)] = s[i] / compliance.sqrt();
        b[(pi, n + i)] = -s[i] / compliance.sqrt();
        b[(n + i, inflow)] = proximal * s[i];
        b[(n + i, slope)] = entry[i] / root[i];
    }
    b[(pi, pi)] = -1.0 / (distal * compliance);
    b[(pi, inflow)] = 1.0 / compliance.sqrt();
    b[(inflow, slope)] = 1.0;
    let scales = stiffness.iter().map(|k| k.sqrt()).chain(root.iter().copied());
    let scales: Vec<f64> = scales.chain([compliance.sqrt(), 1.0, 1.0]).collect();
    let to = DVector::from_vec(scales);
    Propagator::new(b, DMatrix::from_diagonal(&to), DMatrix::from_diagonal(&to.map(|s| 1.0 / s)))
}

impl ToyFsiWindkessel {
    /// The model in a layout.
    ///
    /// # Errors
    /// When the number of modes is out of range.
    pub(crate) fn new(layout: &Layout) -> Result<Self, SetupError> {
        let n = count("modes", layout.modes, 1)?;
        let pressure = Quantity::new("pi", "dyn/cm^2").role(Role::Pressure);
        let outlet = Quantity::new("pressure", "dyn/cm^2").role(Role::Pressure);
        let mut states = wall_fields(n);
        states.push(pressure.says("Pressure across the compliance of the Windkessel."));
        let mut outputs = wall_fields(n);
        outputs.push(outlet.says("Pressure at the outlet, before the Windkessel."));
        let flow = Quantity::new("flow", "cm^3/s").role(Role::Flow);
        let same = |name: &str| (name.to_owned(), name.to_owned());
        let spec = Spec {
            kind: "toy-fsi-windkessel".to_owned(),
            says: "A potential flow in a channel under an elastic wall, from a known inflow to a Windkessel."
                .to_owned(),
            states,
            parameters: Vessel::parameters().into_iter().chain(outlet_parameters()).collect(),
            outputs,
            inputs: vec![flow.says("Volume flow into the vessel.")],
            measures: vec![same(WALL.displacement), same(WALL.velocity)],
            restart: true,
        };
        Ok(Self { spec, spectral: Spectral::quarter_waves(n), systems: Cache::default() })
    }

    /// Builds the model from a definition; with 20 modes without a layout.
    ///
    /// # Errors
    /// When the layout is wrong.
    pub(crate) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&starlings_models_core::layout::read(def)?)?))
    }

    fn system(&self, theta: &[f64]) -> Arc<System> {
        self.systems.get(&theta[..N_SYSTEM], || System::new(&self.spectral, theta))
    }
}

fn outlet_parameters() -> [Quantity; 4] {
    let positive = |name, unit, value| Quantity::new(name, unit).positive().default(value);
    [
        positive("R_p", "dyn s/cm^5", 150.0)
            .role(Role::Resistance)
            .says("Proximal resistance of the Windkessel."),
        positive("R_d", "dyn s/cm^5", 1850.0)
            .role(Role::Resistance)
            .says("Distal resistance of the Windkessel."),
        positive("C", "cm^5/dyn", 1e-3).role(Role::Compliance).says("Compliance of the Windkessel."),
        // 80 mmHg.
        Quantity::new("p_0", "dyn/cm^2")
            .role(Role::Pressure)
            .default(80.0 * 1333.22)
            .says("Initial pressure, in the Windkessel and in the vessel at rest."),
    ]
}

impl Model for ToyFsiWindkessel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let (n, system, pressure) = (self.spectral.len(), self.system(theta), theta[N_SYSTEM]);
        let inflated = system.coupling.component_div(&system.stiffness) * pressure;
        x[..n].copy_from_slice(self.spectral.apply(inflated.as_slice()).as_slice());
        x[n..2 * n].fill(0.0);
        x[2 * n] = pressure;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let (n, system) = (self.spectral.len(), self.system(theta));
        let (position, speed) = (self.spectral.apply(&x[..n]), self.spectral.apply(&x[n..2 * n]));
        let flow = system.outflow(&speed, u.value[0]);
        let Outlet { proximal, distal, compliance } = system.outlet;
        let pressure = x[2 * n] + proximal * flow;
        let strain = position + speed * system.vessel.retardation;
        let force = &system.coupling * pressure + &system.entry * u.slope[0]
            - system.stiffness.component_mul(&strain);
        let acceleration = force.component_div(&system.mass);
        dx[..n].copy_from_slice(&x[n..2 * n]);
        dx[n..2 * n].copy_from_slice(self.spectral.apply(acceleration.as_slice()).as_slice());
        dx[2 * n] = (flow - x[2 * n] / distal) / compliance;
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let (n, system) = (self.spectral.len(), self.system(theta));
        let flow = system.outflow(&self.spectral.apply(&x[n..2 * n]), u.value[0]);
        y[..2 * n].copy_from_slice(&x[..2 * n]);
        y[2 * n] = x[2 * n] + system.outlet.proximal * flow;
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        let vessel = Vessel::read(theta);
        let (n, depth) = (self.spectral.len(), depth(&vessel));
        let matrices = modal_matrices(&self.spectral, &vessel);
        let (solid_mass, added_mass) = (matrices.solid_mass * depth, matrices.added_mass * depth);
        Some(Blocks {
            displacement: 0,
            velocity: n,
            mass: &solid_mass + &added_mass,
            trace: None,
            solid_mass,
            added_mass,
            stiffness: matrices.stiffness * depth,
            windkessel: Some(WindkesselBlock {
                state: 2 * n,
                rate: 1.0 / (theta[Vessel::N + 1] * theta[Vessel::N + 2]),
            }),
            outputs: WallOutputs { pressure: Some("pressure"), ..WALL },
        })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        let (n, system) = (self.spectral.len(), self.system(theta));
        let mut start = DVector::zeros(2 * n + 3);
        start.rows_mut(0, n).copy_from(&self.spectral.apply(&x[..n]));
        start.rows_mut(n, n).copy_from(&self.spectral.apply(&x[n..2 * n]));
        start[2 * n] = x[2 * n];
        start[2 * n + 1] = segment.u0[0];
        start[2 * n + 2] = segment.slope[0];
        let end = &*system.propagator.step(segment.t1 - segment.t0) * start;
        x[..n].copy_from_slice(self.spectral.apply(&end.as_slice()[..n]).as_slice());
        x[n..2 * n].copy_from_slice(self.spectral.apply(&end.as_slice()[n..2 * n]).as_slice());
        x[2 * n] = end[2 * n];
        Ok(())
    }
}
