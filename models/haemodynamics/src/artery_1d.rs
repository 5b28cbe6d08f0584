//! Blood flow in a network of arteries: nonlinear waves of area and flow along each vessel.
//!
//! Large displacements, convection, taper and branching are here; the wall's inertia is not (at the frequencies of a pulse
//! ρ_s h ω² is below a thousandth of the wall's stiffness), nor are valves, the heart, and flow faster than its waves. The
//! linear tube [`super::fsi_tube`] is another model of one such vessel. Next file to read: `artery_1d/vessels.rs`, then
//! `artery_1d/step.rs`.

mod checks;
mod layout;
mod network;
mod node;
mod pressures;
mod quantities;
mod shear;
mod stenosis;
mod step;
mod transport;
mod vessels;
mod viscous;
mod wall;

use starlings_models_core::blocks::{Sections, WindkesselBlock};
use starlings_models_core::segment::Segment;
use starlings_models_core::{Drive, Model, ModelDef, ModelFailure, SetupError, Spec};

use crate::MOST_STEPS;
use layout::Layout;
use network::Network;
use step::Volumes;
use step::{Inflow, Work};
use vessels::Vessels;

/// Area A and flow Q along vessels (Hughes & Lubliner 1973; Formaggia, Lamponi & Quarteroni 2003), with R = √(A/π):
///
/// ∂A/∂t + ∂Q/∂x = 0,  ∂Q/∂t + ∂(α Q²/A)/∂x + (A/ρ) ∂p/∂x = −K_r Q/A,  K_r = 2(ζ + 2)πμ/ρ,
///
/// p = p_ext + (E h/((1 − ν²)R0²) + k_s)(R − R0) + (c_w + c_s) ∂R/∂t.
///
/// The wall's circumferential stress is that of a ring kept from moving along the axis, σ = E (R − R0)/((1 − ν²) R0) + c_w (R0/h) ∂R/∂t.
///
/// At junctions mass is conserved and p + ½ρu² is continuous; at an RCR outlet p = π + R_p Q and C dπ/dt = Q −
/// (π − p_venous)/R_d. A stenosis takes the pressure of Young & Tsai (1973; `artery_1d/stenosis.rs`), and where a segment asks for it the
/// friction is that of unsteady laminar flow (Womersley 1955, Zielke 1968; `artery_1d/shear.rs`). Units are cm, g, s and dyn/cm². The vessels, their Young's moduli E and the outlets are those of the
/// [`Layout`].
pub struct Artery1d {
    spec: Spec,
    network: Network,
}

/// Why a step was not possible.
#[derive(Clone, Debug, PartialEq)]
enum Fault {
    /// A vessel has no area left.
    Collapsed { cell: usize },
    /// The flow in a cell is not slower than its waves.
    Supercritical { cell: usize },
    /// The vessels at a node allow no flow slower than its waves.
    Node { name: String },
    /// The pressures of all nodes together have no solution.
    Network,
    /// The severity of a stenosis lies outside its range.
    Severity { name: String, severity: f64 },
}

impl Fault {
    fn at(self, t: f64) -> ModelFailure {
        ModelFailure::Solver(match self {
            Self::Collapsed { cell } => format!("the vessel collapses in cell {cell} at t = {t}"),
            Self::Supercritical { cell } => {
                format!("the flow reaches the speed of its waves in cell {cell} at t = {t}")
            }
            Self::Network => format!("no pressures of its nodes fit the network at t = {t}"),
            Self::Severity { name, severity } => format!(
                "the stenosis `{name}` has a severity of {severity}: give a part of the area from 0 to {}, as by a prior \
                 `logit(0, {0})`; end the vessel in an outlet where nothing passes",
                stenosis::MOST_SEVERE
            ),
            Self::Node { name } => {
                format!("no flow below the speed of its waves fits the node `{name}` at t = {t}")
            }
        })
    }
}

impl Artery1d {
    /// Makes a network in this layout.
    ///
    /// # Errors
    /// When the layout cannot be; the error says where.
    pub fn new(layout: &Layout) -> Result<Self, SetupError> {
        let network = Network::new(layout)?;
        Ok(Self { spec: quantities::spec(&network), network })
    }

    /// Makes the network of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(super) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        Ok(Box::new(Self::new(&starlings_models_core::layout::read(def)?)?))
    }

    /// Advances the state over one segment as [`Model::advance`] does, and says what entered and left the network on the way.
    ///
    /// # Errors
    /// When an input is not finite, a severity lies outside its range, a vessel collapses or a flow reaches the speed of its waves.
    pub fn advance_counting(
        &self,
        segment: Segment<'_>,
        theta: &[f64],
        x: &mut [f64],
    ) -> Result<Volumes, ModelFailure> {
        let is_bad = |(u, slope): (&f64, &f64)| !(u.is_finite() && slope.is_finite());
        if let Some(i) = segment.u0.iter().zip(segment.slope).position(is_bad) {
            let what = format!("input `{}`", Spec::component(&self.spec.inputs, i));
            return Err(ModelFailure::NotFinite { what, time: segment.t0 });
        }
        let vessels = Vessels::new(&self.network, theta);
        vessels.open().map_err(|fault| fault.at(segment.t0))?;
        let (mut work, mut volumes) = (Work::new(&vessels), Volumes::default());
        let (mut t, mut n_step) = (segment.t0, 0);
        while t < segment.t1 {
            if let Some(i) = x.iter().position(|value| !value.is_finite()) {
                let what = format!("state `{}`", Spec::component(&self.spec.states, i));
                return Err(ModelFailure::NotFinite { what, time: t });
            }
            let longest = vessels.longest_step(x);
            if longest.is_nan() {
                return Err(ModelFailure::NotFinite { what: "the speed of waves".to_owned(), time: t });
            }
            let next = segment.next_time(t, longest)?;
            let inflow = Inflow { start: segment.u0, slope: segment.slope, since: t - segment.t0 };
            vessels.step(next - t, inflow, x, &mut work, &mut volumes).map_err(|fault| fault.at(t))?;
            t = next;
            n_step += 1;
            if n_step > MOST_STEPS {
                return Err(ModelFailure::TooManySteps { time: t, limit: MOST_STEPS });
            }
        }
        Ok(volumes)
    }

    /// Volume in cm³ that the vessels hold in a state.
    pub fn volume(&self, x: &[f64]) -> f64 {
        let of = |tube: &network::Tube| tube.dx * x[tube.first..tube.first + tube.n].iter().sum::<f64>();
        self.network.tubes.iter().map(of).sum()
    }
}

impl Model for Artery1d {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// At rest under the pressure p0.
    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let vessels = Vessels::new(&self.network, theta);
        let n = self.network.n_cell;
        for (area, ring) in x.iter_mut().zip(&vessels.cells) {
            *area = ring.area(vessels.p_start - vessels.p_ext);
        }
        x[n..2 * n].fill(0.0);
        x[2 * n..vessels.narrowed].fill(vessels.p_start);
        x[vessels.narrowed..].fill(0.0);
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let vessels = Vessels::new(&self.network, theta);
        if vessels.rate(u.value, x, &mut Work::new(&vessels), dx).is_err() {
            dx.fill(f64::NAN);
        }
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let vessels = Vessels::new(&self.network, theta);
        let (n, mut work) = (self.network.n_cell, Work::new(&vessels));
        let mut rate = vec![0.0; x.len()];
        if vessels.rate(u.value, x, &mut work, &mut rate).is_err() {
            return y.fill(f64::NAN);
        }
        let (y, hoop) = y.split_at_mut(self.spec.n_output() - 2 * n);
        let (strain, stress) = hoop.split_at_mut(n);
        for (i, tube) in self.network.tubes.iter().enumerate() {
            let first = Vessels::first_face(i, tube);
            for j in 0..tube.n {
                let (cell, ring) = (tube.first + j, vessels.cells[tube.first + j]);
                let viscous = 0.5 * (work.viscous.face[first + j] + work.viscous.face[first + j + 1]);
                y[cell] = ring.displacement(x[cell]);
                y[n + cell] = vessels.p_ext + ring.pressure(x[cell]) + viscous;
                [strain[cell], stress[cell]] = vessels.strain_and_stress(tube, j, x[cell], viscous);
            }
        }
        y[2 * n..3 * n].copy_from_slice(&x[n..2 * n]);
        let (inlets, outlets) = y[3 * n..].split_at_mut(self.network.inlets.len());
        for (&node, y) in self.network.inlets.iter().zip(inlets) {
            *y = work.faces.node[node];
        }
        let (outlets, drops) = outlets.split_at_mut(2 * self.network.outlets.len());
        for (&node, y) in self.network.outlets.iter().zip(outlets.chunks_mut(2)) {
            y[0] = work.faces.node[node];
            y[1] = vessels.outflow(node, &work.faces);
        }
        for (narrowing, y) in self.network.narrowings.iter().zip(drops) {
            let [before, after] = narrowing.nodes.map(|node| work.faces.node[node]);
            *y = before - after;
        }
    }

    fn sections(&self, theta: &[f64]) -> Option<Sections> {
        let vessels = Vessels::new(&self.network, theta);
        let chamber = |(&node, outlet): (&usize, &vessels::Outlet)| {
            let (number, distal, compliance) = outlet.chamber?;
            let state = 2 * self.network.n_cell + number;
            let block = WindkesselBlock { state, rate: 1.0 / (distal * compliance) };
            Some((block, quantities::named(&self.network, "outlet_pressure", node)))
        };
        Some(Sections {
            area: 0,
            n: self.network.n_cell,
            displacement: "displacement",
            outlets: self.network.outlets.iter().zip(&vessels.outlets).filter_map(chamber).collect(),
        })
    }

    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        self.advance_counting(segment, theta, x).map(|_| ())
    }
}
