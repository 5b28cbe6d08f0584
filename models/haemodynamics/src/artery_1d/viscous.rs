//! What is implicit in time: the viscosity of wall and tissue, a diffusion of the flow, with the losses of [`super::stenosis`] and
//! the memory of [`super::shear`].
//!
//! A radial velocity ∂R/∂t = −(∂Q/∂x)/(2πR) adds p_v = −Γ (∂Q/∂x)/(2πR) to the pressure, Γ = c_w + c_s, and
//! −(A/ρ) ∂p_v/∂x to the rate of Q (Alastruey et al. 2011). With p_v the equations ask for one condition at each end, on the
//! whole pressure p_ext + elastic + p_v: half a cell from the end, p_v follows from the flow through it, and the nodes'
//! pressures are unknowns together with the flows in the cells. Each tube is a tridiagonal system and its response to the
//! pressures of its two nodes; what the nodes ask for closes the system. Next file to read: [`super::pressures`].

use std::f64::consts::PI;

use super::Fault;
use super::layout::NodeKind;
use super::vessels::Vessels;
use super::wall::radius;

/// How one end of a tube couples flow and pressure: p_v = P − b, b = b0 + d (Q − Q_0), flow through the end
/// s Q + (b − P)/g into the node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Coupling {
    /// b0: external, elastic and, at a junction, dynamic pressure at the end.
    pub(super) pressure: f64,
    /// d: change of the dynamic pressure with the flow.
    pub(super) slope: f64,
    /// 1/g, flow per viscous pressure over half a cell.
    pub(super) mobility: f64,
}

/// The viscous part of a state; reused from step to step.
#[derive(Default)]
pub(super) struct Viscous {
    /// Γ/(2πR dx) at each face; zero at the ends.
    weight: Vec<f64>,
    pub(super) couplings: Vec<Coupling>,
    /// What the factored matrices have above their diagonal of ones.
    above: Vec<f64>,
    /// Flows in the cells if the nodes had no pressure.
    pub(super) free: Vec<f64>,
    /// Response of the flows to the pressure at the start and at the end of their tube.
    pub(super) response: [Vec<f64>; 2],
    /// What the memory of the wall shear does to the flow in each cell, zero where there is none ([`super::shear`]).
    pub(super) drag: Vec<f64>,
    pub(super) pull: Vec<f64>,
    /// p_v at each face.
    pub(super) face: Vec<f64>,
    /// p_v at each end, in the order of [`End::index`].
    pub(super) end: Vec<f64>,
}

impl Viscous {
    pub(super) fn new(vessels: &Vessels<'_>) -> Self {
        let (n, n_face) = (vessels.network.n_cell, vessels.faces.len());
        let n_end = 2 * vessels.network.tubes.len();
        Self {
            weight: vec![0.0; n_face],
            couplings: vec![Coupling::default(); n_end],
            above: vec![0.0; n],
            free: vec![0.0; n],
            response: [vec![0.0; n], vec![0.0; n]],
            drag: vec![0.0; n],
            pull: vec![0.0; n],
            face: vec![0.0; n_face],
            end: vec![0.0; n_end],
        }
    }
}

impl Vessels<'_> {
    /// Solves Q − τ G(Q) = r for the flows of the state `x`, which hold r, at fixed areas, and writes G(Q), the viscous part
    /// of the rate of Q; with τ = 0 it is that of the given flows. Flows through narrowings are among them.
    ///
    /// # Errors
    /// When the nodes' pressures have no solution, in a vessel that has collapsed.
    pub(super) fn diffuse(
        &self,
        tau: f64,
        inflow: &[f64],
        x: &mut [f64],
        work: &mut Viscous,
        rate: &mut [f64],
    ) -> Result<(), Fault> {
        rate.fill(0.0);
        self.remember(tau, x, work);
        if self.damping <= 0.0 {
            self.drag(x, work);
            self.shear(tau, x, rate);
            self.slow(tau, x, rate);
            return Ok(());
        }
        for tube in 0..self.network.tubes.len() {
            self.couple(tube, x, work);
            self.respond(tube, tau, x, work);
        }
        let pressures = self.node_pressures(tau, inflow, x, work)?;
        let n = self.network.n_cell;
        for (i, tube) in self.network.tubes.iter().enumerate() {
            let [from, to] = tube.nodes.map(|node| pressures[node]);
            let first = Self::first_face(i, tube);
            // The dynamic pressures were linearised at r.
            let given = [x[n + tube.first], x[n + tube.first + tube.n - 1]];
            for j in tube.first..tube.first + tube.n {
                // The responses replace r only here, after the nodes have used it.
                x[n + j] = work.free[j] + work.response[0][j] * from + work.response[1][j] * to;
            }
            for j in 1..tube.n {
                let face = first + j;
                let cell = n + tube.first + j;
                work.face[face] = -work.weight[face] * (x[cell] - x[cell - 1]);
            }
            let flows = [x[n + tube.first], x[n + tube.first + tube.n - 1]];
            for (side, pressure) in [from, to].into_iter().enumerate() {
                let coupling = work.couplings[2 * i + side];
                let viscous = pressure - coupling.pressure - coupling.slope * (flows[side] - given[side]);
                work.end[2 * i + side] = viscous;
                work.face[first + side * tube.n] = viscous;
            }
            for j in 0..tube.n {
                let cell = tube.first + j;
                let force = work.face[first + j + 1] - work.face[first + j];
                rate[n + cell] = -x[cell] / (self.rho * tube.dx) * force;
            }
        }
        self.shear(tau, x, rate);
        for (k, (loss, narrowing)) in self.losses.iter().zip(&self.network.narrowings).enumerate() {
            let flow = pressures[self.network.nodes.len() + k];
            let [before, after] =
                narrowing.nodes.map(|node| work.end[self.network.nodes[node].ends[0].index()]);
            x[self.narrowed + k] = flow;
            rate[self.narrowed + k] = (before - after - loss.steady(flow)) / loss.inertance;
        }
        Ok(())
    }

    /// Weights of the faces and couplings of the ends of one tube.
    fn couple(&self, tube: usize, x: &[f64], work: &mut Viscous) {
        let of = &self.network.tubes[tube];
        let (n, first) = (self.network.n_cell, Self::first_face(tube, of));
        let weight = |radius: f64| self.damping / (2.0 * PI * radius * of.dx);
        for j in 1..of.n {
            let cell = of.first + j;
            work.weight[first + j] = weight(0.5 * (radius(x[cell - 1]) + radius(x[cell])));
        }
        for (side, node) in of.nodes.into_iter().enumerate() {
            // The end's cell, its neighbour and the end's face.
            let (cell, next, face) = if side == 0 {
                (of.first, of.first + 1, first)
            } else {
                (of.first + of.n - 1, of.first + of.n - 2, first + of.n)
            };
            let brought = |own: f64, next: f64| 1.5 * own - 0.5 * next;
            let elastic = brought(self.cells[cell].pressure(x[cell]), self.cells[next].pressure(x[next]));
            let area = self.faces[face].area(elastic);
            let mut coupling =
                Coupling { pressure: self.p_ext + elastic, slope: 0.0, mobility: 0.5 / weight(radius(area)) };
            if self.network.nodes[node].kind == NodeKind::Junction {
                let velocity = brought(x[n + cell], x[n + next]) / area;
                coupling.pressure += 0.5 * self.rho * velocity * velocity;
                coupling.slope = self.rho * velocity / area;
            }
            work.couplings[2 * tube + side] = coupling;
        }
    }

    /// Solves one tube's system without its nodes, and for a pressure of one at each of them.
    fn respond(&self, tube: usize, tau: f64, x: &[f64], work: &mut Viscous) {
        let of = &self.network.tubes[tube];
        let first = Self::first_face(tube, of);
        let cells = of.first..of.first + of.n;
        let (area, flow) = (&x[cells.clone()], &x[self.network.n_cell..][cells.clone()]);
        let weight = &work.weight[first..=first + of.n];
        let couplings = &work.couplings[2 * tube..2 * tube + 2];
        let [start, end] = &mut work.response;
        let (start, end) = (&mut start[cells.clone()], &mut end[cells.clone()]);
        let (free, above) = (&mut work.free[cells.clone()], &mut work.above[cells.clone()]);
        let (drag, pull) = (&work.drag[cells.clone()], &work.pull[cells]);
        let scale = |j: usize| tau * area[j] / (self.rho * of.dx);
        let last = of.n - 1;
        for (free, (flow, pull)) in free.iter_mut().zip(flow.iter().zip(pull)) {
            *free = flow - pull;
        }
        start.fill(0.0);
        end.fill(0.0);
        free[0] -= scale(0) * (couplings[0].pressure - couplings[0].slope * flow[0]);
        free[last] += scale(last) * (couplings[1].pressure - couplings[1].slope * flow[last]);
        start[0] = scale(0);
        end[last] = -scale(last);
        for j in 0..of.n {
            let a = scale(j);
            let mut pivot = 1.0 + drag[j] + a * (weight[j] + weight[j + 1]);
            if j == 0 {
                pivot += a * couplings[0].slope;
            } else {
                let below = -a * weight[j];
                pivot -= below * above[j - 1];
                for values in [&mut *free, &mut *start, &mut *end] {
                    values[j] -= below * values[j - 1];
                }
            }
            if j == last {
                pivot -= a * couplings[1].slope;
            }
            above[j] = -a * weight[j + 1] / pivot;
            for values in [&mut *free, &mut *start, &mut *end] {
                values[j] /= pivot;
            }
        }
        for j in (0..last).rev() {
            for values in [&mut *free, &mut *start, &mut *end] {
                values[j] -= above[j] * values[j + 1];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Artery1d;
    use super::super::layout::Layout;
    use super::super::step::Work;
    use super::*;
    use starlings_models_core::Model;

    #[test]
    fn pressures_that_have_no_solution_are_a_fault_of_the_network_and_not_of_its_inlet() {
        let model = Artery1d::new(&Layout::default()).expect("the default layout");
        let theta: Vec<f64> = model.spec.parameters.iter().filter_map(|q| q.default).collect();
        let mut x = vec![0.0; model.spec.n_state()];
        model.initial(&theta, &mut x);
        let vessels = Vessels::new(&model.network, &theta);
        let mut rate = x.clone();
        assert_eq!(vessels.rate(&[0.0], &x, &mut Work::new(&vessels), &mut rate), Ok(()));
        // The pressure behind the outlet.
        x[40] = f64::INFINITY;
        let fault = vessels.rate(&[0.0], &x, &mut Work::new(&vessels), &mut rate);
        assert_eq!(fault, Err(Fault::Network));
        assert!(Fault::Network.at(0.5).to_string().contains("the network at t = 0.5"));
    }
}
