//! The network with the values of its parameters: walls, blood and outlets.
//!
//! Next file to read: [`super::step`], which advances it.

use std::f64::consts::PI;

use super::layout::NodeKind;
use super::network::{Network, Tube};
use super::shear::TERMS;
use super::stenosis::Loss;
use super::wall::Ring;

/// Number of parameters that all vessels share.
const N_SHARED: usize = 10;

/// What is beyond an outlet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outlet {
    /// Resistance between the vessel and the pressure behind it, dyn s/cm⁵.
    pub(super) proximal: f64,
    /// The Windkessel: its state's number among the Windkessels, distal resistance, compliance.
    pub(super) chamber: Option<(usize, f64, f64)>,
}

/// All that the equations need to know.
pub(super) struct Vessels<'a> {
    pub(super) network: &'a Network,
    /// Wall in each cell.
    pub(super) cells: Vec<Ring>,
    /// Wall at each face; those of tube i start at its first cell plus i.
    pub(super) faces: Vec<Ring>,
    /// Density ρ of the blood.
    pub(super) rho: f64,
    /// Momentum coefficient α.
    pub(super) alpha: f64,
    /// K_r = 8πμ/ρ in cm²/s: the friction of a parabolic profile per flow and area; a tube has a multiple of it.
    pub(super) friction: f64,
    /// Γ = c_w + c_s: pressure per radial velocity of wall and tissue.
    pub(super) damping: f64,
    /// The wall's share c_w/Γ of that; zero without any.
    wall_damping: f64,
    /// Stiffness of the tissue k_s in dyn/cm³.
    tissue: f64,
    pub(super) p_ext: f64,
    pub(super) p_venous: f64,
    /// Pressure of the initial state.
    pub(super) p_start: f64,
    pub(super) outlets: Vec<Outlet>,
    pub(super) losses: Vec<Loss>,
    /// Number of the state that is the flow through the first narrowing; the others follow.
    pub(super) narrowed: usize,
    /// Number of the first state of the wall shear's memory.
    pub(super) remembered: usize,
}

impl<'a> Vessels<'a> {
    /// The network at these parameters, in the order of [`super::quantities`].
    pub(super) fn new(network: &'a Network, theta: &[f64]) -> Self {
        let n = network.tubes.len();
        let [rho, mu, nu, alpha, c_w, k_s, c_s, p_ext, p_venous, p_start] =
            std::array::from_fn(|i| theta[n + i]);
        let (outlets, rest) = outlets(network, &theta[n + N_SHARED..]);
        let loss = |(narrowing, own): (_, &[f64])| Loss::new(narrowing, [own[0], own[1], own[2]], mu, rho);
        let n_chamber = outlets.iter().filter(|outlet| outlet.chamber.is_some()).count();
        let mut vessels = Self {
            network,
            cells: Vec::with_capacity(network.n_cell),
            faces: Vec::with_capacity(network.n_cell + n),
            rho,
            alpha,
            friction: 8.0 * PI * mu / rho,
            damping: c_w + c_s,
            wall_damping: if c_w > 0.0 { c_w / (c_w + c_s) } else { 0.0 },
            tissue: k_s,
            p_ext,
            p_venous,
            p_start,
            outlets,
            losses: network.narrowings.iter().zip(rest.chunks(3)).map(loss).collect(),
            narrowed: 2 * network.n_cell + n_chamber,
            remembered: 2 * network.n_cell + n_chamber + network.narrowings.len(),
        };
        for (tube, young) in network.tubes.iter().zip(theta) {
            let ring = |radius: f64, thickness: f64| {
                // E h; of a law, a multiple of what it says.
                let held = tube.wall.map_or(thickness, |law| radius * law.at(radius));
                let plate = young * held / (1.0 - nu * nu);
                Ring { stiffness: plate / (radius * radius) + k_s, radius }
            };
            let (radius, thickness) = (&tube.radius, &tube.thickness);
            vessels.faces.extend(radius.iter().zip(thickness).map(|(&radius, &h)| ring(radius, h)));
            let middle = |pair: &[f64]| 0.5 * (pair[0] + pair[1]);
            let cells = radius.windows(2).zip(thickness.windows(2));
            vessels.cells.extend(cells.map(|(radius, h)| ring(middle(radius), middle(h))));
        }
        vessels
    }

    /// Circumferential strain ε = (R − R0)/R0 and stress of the wall in cell `j` of a tube, σ = E ε/(1 − ν²) + c_w (∂R/∂t) R0/h, where
    /// `viscous` is the pressure (c_w + c_s) ∂R/∂t. The wall alone holds the pressure σ h/R0.
    pub(super) fn strain_and_stress(&self, tube: &Tube, j: usize, area: f64, viscous: f64) -> [f64; 2] {
        let ring = self.cells[tube.first + j];
        let thickness = 0.5 * (tube.thickness[j] + tube.thickness[j + 1]);
        let stretch = ring.displacement(area);
        let held = (ring.stiffness - self.tissue) * stretch + self.wall_damping * viscous;
        [stretch / ring.radius, held * ring.radius / thickness]
    }

    /// Number of state components.
    pub(super) fn n_state(&self) -> usize {
        self.remembered + TERMS.len() * self.network.n_memory
    }

    /// The face before the first cell of a tube; its other faces follow.
    pub(super) fn first_face(tube: usize, of: &Tube) -> usize {
        of.first + tube
    }

    /// Pressure behind the proximal resistance of an outlet.
    pub(super) fn behind(&self, outlet: Outlet, x: &[f64]) -> f64 {
        outlet.chamber.map_or(self.p_venous, |(i, ..)| x[2 * self.network.n_cell + i])
    }
}

/// The outlets, and the parameters behind theirs.
fn outlets<'a>(network: &Network, theta: &'a [f64]) -> (Vec<Outlet>, &'a [f64]) {
    let (mut theta, mut n_chamber) = (theta, 0);
    let mut all = Vec::with_capacity(network.outlets.len());
    for &node in &network.outlets {
        let own = if network.nodes[node].kind == NodeKind::Rcr { 3 } else { 1 };
        let (values, rest) = theta.split_at(own);
        theta = rest;
        let chamber = (own == 3).then(|| {
            n_chamber += 1;
            (n_chamber - 1, values[1], values[2])
        });
        all.push(Outlet { proximal: values[0], chamber });
    }
    (all, theta)
}
