//! Convection, pressure and friction: the hyperbolic part of the equations by finite volumes.
//!
//! Second order in space: elastic pressure and flow are linear in each cell, with slopes limited at fronts (van Leer 1979).
//! Faces have one wall each, so that the areas on the two sides of a face are equal where the pressures are: a state at rest
//! stays at rest for any radius and stiffness along the vessel (hydrostatic reconstruction, Audusse et al. 2004; Delestre &
//! Lagrée 2013). Faces inside a tube take the flux of Harten, Lax & van Leer (1983), written as differences from its two
//! sides; the force of the pressure inside a cell is that of its own reconstruction. Next file to read: [`super::viscous`].

use super::Fault;
use super::node::{Arriving, Condition, Met};
use super::vessels::Vessels;

/// One side of a face.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    area: f64,
    flow: f64,
    /// Elastic pressure.
    pressure: f64,
}

/// What passes the faces of the network; reused from step to step.
#[derive(Default)]
pub(super) struct Faces {
    before: Vec<Side>,
    after: Vec<Side>,
    /// Flow through each face.
    mass: Vec<f64>,
    /// Momentum flux less the pressure part on the side before and after the face.
    push: Vec<[f64; 2]>,
    pressure: Vec<f64>,
    arriving: Vec<Arriving>,
    met: Vec<Met>,
    /// Pressure of each node: total at a junction.
    pub(super) node: Vec<f64>,
}

impl Faces {
    pub(super) fn new(vessels: &Vessels<'_>) -> Self {
        let (n_face, n_node) = (vessels.faces.len(), vessels.network.nodes.len());
        Self {
            before: vec![Side::default(); n_face],
            after: vec![Side::default(); n_face],
            mass: vec![0.0; n_face],
            push: vec![[0.0; 2]; n_face],
            pressure: vec![0.0; vessels.network.n_cell],
            node: vec![0.0; n_node],
            ..Self::default()
        }
    }
}

impl Vessels<'_> {
    /// Writes the hyperbolic part of the rate of the state; `viscous` is the viscous pressure at each end.
    ///
    /// # Errors
    /// When a vessel has collapsed, or a cell or a node has no subcritical flow.
    pub(super) fn transport(
        &self,
        x: &[f64],
        viscous: &[f64],
        inflow: &[f64],
        faces: &mut Faces,
        rate: &mut [f64],
    ) -> Result<(), Fault> {
        let n = self.network.n_cell;
        for tube in 0..self.network.tubes.len() {
            self.reconstruct(tube, x, faces)?;
            self.inner_faces(tube, faces);
        }
        for node in 0..self.network.nodes.len() {
            self.end_faces(node, x, viscous, inflow, faces)?;
        }
        for (i, tube) in self.network.tubes.iter().enumerate() {
            let (first, friction) = (Self::first_face(i, tube), tube.friction * self.friction);
            for j in 0..tube.n {
                let (cell, left, right) = (tube.first + j, first + j, first + j + 1);
                let (a, b) = (faces.after[left], faces.before[right]);
                let force = 0.5 * (a.area + b.area) / self.rho * (b.pressure - a.pressure);
                let push = faces.push[right][0] - faces.push[left][1];
                rate[cell] = (faces.mass[left] - faces.mass[right]) / tube.dx;
                rate[n + cell] = -(push + force) / tube.dx - friction * x[n + cell] / x[cell];
            }
        }
        for (outlet, &node) in self.outlets.iter().zip(&self.network.outlets) {
            if let Some((i, distal, compliance)) = outlet.chamber {
                let behind = x[2 * n + i];
                rate[2 * n + i] =
                    (self.outflow(node, faces) - (behind - self.p_venous) / distal) / compliance;
            }
        }
        for (k, (loss, narrowing)) in self.losses.iter().zip(&self.network.narrowings).enumerate() {
            // What the walls' viscosity adds on either side is implicit, as the loss is.
            let [before, after] = narrowing
                .nodes
                .map(|node| faces.node[node] - viscous[self.network.nodes[node].ends[0].index()]);
            rate[self.narrowed + k] = (before - after) / loss.inertance;
        }
        rate[self.remembered..].fill(0.0);
        Ok(())
    }

    /// Flow that leaves the network at a node with one end.
    pub(super) fn outflow(&self, node: usize, faces: &Faces) -> f64 {
        let end = self.network.nodes[node].ends[0];
        end.sign * faces.mass[self.end_face(end)]
    }

    fn end_face(&self, end: super::network::End) -> usize {
        let tube = &self.network.tubes[end.tube];
        Self::first_face(end.tube, tube) + if end.sign > 0.0 { tube.n } else { 0 }
    }

    /// Linear pressure and flow in the cells of one tube, and what they are at its faces.
    fn reconstruct(&self, tube: usize, x: &[f64], faces: &mut Faces) -> Result<(), Fault> {
        let of = &self.network.tubes[tube];
        let (cells, first) = (of.first..of.first + of.n, Self::first_face(tube, of));
        for i in cells.clone() {
            faces.pressure[i] = self.cells[i].pressure(x[i]);
            // Of its two characteristic variables a vessel sends one to each end as long as α u² < c².
            let (u, c) = (x[self.network.n_cell + i] / x[i], self.cells[i].speed(x[i], self.rho));
            if self.alpha * u * u >= c * c {
                return Err(Fault::Supercritical { cell: i });
            }
        }
        let pressure = &faces.pressure[cells.clone()];
        let n = self.network.n_cell;
        let flow = &x[n + of.first..n + of.first + of.n];
        let [smooth_pressure, smooth_flow] = self.smooth(tube);
        for j in 0..of.n {
            let (dp, dq) = (0.5 * slope(pressure, j, smooth_pressure), 0.5 * slope(flow, j, smooth_flow));
            let side = |face: usize, sign: f64| {
                let (pressure, flow) = (pressure[j] + sign * dp, flow[j] + sign * dq);
                Side { area: self.faces[face].area(pressure), flow, pressure }
            };
            let (after, before) = (side(first + j, -1.0), side(first + j + 1, 1.0));
            if !(x[of.first + j] > 0.0 && after.area > 0.0 && before.area > 0.0) {
                return Err(Fault::Collapsed { cell: of.first + j });
            }
            faces.after[first + j] = after;
            faces.before[first + j + 1] = before;
        }
        Ok(())
    }

    /// Squared differences of pressure and flow that count as smooth in a tube.
    fn smooth(&self, tube: usize) -> [f64; 2] {
        let of = &self.network.tubes[tube];
        let ring = self.cells[of.first];
        let area = ring.area(0.0);
        let [pressure, flow] = [ring.stiffness * ring.radius, area * ring.speed(area, self.rho)];
        let part = SMOOTH * (of.dx / ring.radius).powi(3);
        [part * pressure * pressure, part * flow * flow]
    }

    /// Harten, Lax & van Leer's flux at the faces between the cells of a tube.
    fn inner_faces(&self, tube: usize, faces: &mut Faces) {
        let of = &self.network.tubes[tube];
        let first = Self::first_face(tube, of);
        for face in first + 1..first + of.n {
            let (l, r, ring) = (faces.before[face], faces.after[face], self.faces[face]);
            let (ul, ur) = (l.flow / l.area, r.flow / r.area);
            let c = ring.speed(l.area, self.rho).max(ring.speed(r.area, self.rho));
            let slowest = (self.alpha * ul.min(ur) - c).min(0.0);
            let fastest = (self.alpha * ul.max(ur) + c).max(0.0);
            let convected = [self.alpha * l.flow * ul, self.alpha * r.flow * ur];
            let impulse = ring.impulse(r.area, self.rho) - ring.impulse(l.area, self.rho);
            let flux = convected[1] - convected[0] + impulse;
            let (left, right) = (slowest / (fastest - slowest), fastest / (fastest - slowest));
            let (area, flow) = (r.area - l.area, r.flow - l.flow);
            faces.mass[face] = l.flow + left * (fastest * area - flow);
            faces.push[face] = [
                convected[0] + left * (fastest * flow - flux),
                convected[1] + right * (slowest * flow - flux),
            ];
        }
    }

    /// The faces at which tubes meet a node.
    fn end_faces(
        &self,
        node: usize,
        x: &[f64],
        viscous: &[f64],
        inflow: &[f64],
        faces: &mut Faces,
    ) -> Result<(), Fault> {
        let of = &self.network.nodes[node];
        let Faces { before, after, mass, push, arriving, met, .. } = faces;
        let side = |end: super::network::End| {
            let face = self.end_face(end);
            (face, if end.sign > 0.0 { before[face] } else { after[face] })
        };
        arriving.clear();
        arriving.extend(of.ends.iter().map(|&end| {
            let (face, Side { area, flow, .. }) = side(end);
            let beside = self.p_ext + viscous[end.index()];
            Arriving { sign: end.sign, ring: self.faces[face], area, velocity: flow / area, beside }
        }));
        met.clear();
        met.resize(arriving.len(), Met::default());
        let condition = match (of.inlet, of.outlet, of.narrowing) {
            (Some(i), ..) => Condition::Joint { inflow: inflow[i], total: false },
            (_, Some(i), _) => {
                let outlet = self.outlets[i];
                Condition::Outlet { resistance: outlet.proximal, behind: self.behind(outlet, x) }
            }
            (.., Some((i, sign))) => Condition::Joint { inflow: sign * x[self.narrowed + i], total: true },
            _ => Condition::Joint { inflow: 0.0, total: true },
        };
        let solved = condition.meet(self.rho, arriving, met);
        faces.node[node] = solved.ok_or_else(|| Fault::Node { name: of.name.clone() })?;
        for (&end, met) in of.ends.iter().zip(&*met) {
            let (face, inside) = side(end);
            let ring = self.faces[face];
            mass[face] = met.flow;
            let impulse = ring.impulse(met.area, self.rho) - ring.impulse(inside.area, self.rho);
            push[face] = [self.alpha * met.flow * met.flow / met.area + impulse; 2];
        }
        Ok(())
    }

    /// The longest stable time step: half a cell at the fastest wave, and half the shortest time of friction, of a
    /// Windkessel and of the blood in a narrowing between its vessels; NaN where a vessel has no waves.
    pub(super) fn longest_step(&self, x: &[f64]) -> f64 {
        let n = self.network.n_cell;
        let mut rate = 0.0_f64;
        for tube in &self.network.tubes {
            for i in tube.first..tube.first + tube.n {
                let speed = self.alpha * (x[n + i] / x[i]).abs() + self.cells[i].speed(x[i], self.rho);
                // At once: the maximum of NaN and a number is the number.
                if speed.is_nan() {
                    return f64::NAN;
                }
                rate = rate.max(speed / tube.dx).max(tube.friction * self.friction / x[i]);
            }
        }
        for (outlet, &node) in self.outlets.iter().zip(&self.network.outlets) {
            if let Some((_, distal, compliance)) = outlet.chamber {
                let impedance = self.impedance(node, x);
                rate = rate.max((1.0 / distal + 1.0 / (outlet.proximal + impedance)) / compliance);
            }
        }
        for (loss, narrowing) in self.losses.iter().zip(&self.network.narrowings) {
            let impedances = narrowing.nodes.map(|node| self.impedance(node, x));
            rate = rate.max((impedances[0] + impedances[1]) / loss.inertance);
        }
        COURANT / rate
    }

    /// Characteristic impedance ρc/A of the cell that a node with one end stands at, in dyn s/cm⁵.
    fn impedance(&self, node: usize, x: &[f64]) -> f64 {
        let end = self.network.nodes[node].ends[0];
        let tube = &self.network.tubes[end.tube];
        let cell = tube.first + if end.sign > 0.0 { tube.n - 1 } else { 0 };
        self.rho * self.cells[cell].speed(x[cell], self.rho) / x[cell]
    }
}

/// Part of a cell that the fastest wave may cross in a step: half keeps areas positive with linear reconstruction.
const COURANT: f64 = 0.5;

/// Squared differences below which a slope is not limited, per squared scale of the values and (dx/R0)³: small enough to
/// vanish beside those of a front, large enough to leave a smooth crest its slope (Venkatakrishnan 1995).
const SMOOTH: f64 = 0.01;

/// Limited difference across cell j (van Albada, van Leer & Roberts 1982); plain at the ends, which have one neighbour.
fn slope(values: &[f64], j: usize, smooth: f64) -> f64 {
    let last = values.len() - 1;
    if j == 0 {
        return values[1] - values[0];
    }
    if j == last {
        return values[last] - values[last - 1];
    }
    let (back, ahead) = (values[j] - values[j - 1], values[j + 1] - values[j]);
    let (wb, wa) = (ahead * ahead + smooth, back * back + smooth);
    (wb * back + wa * ahead) / (wb + wa)
}
