//! The pressures of all nodes together, and the flows through narrowings, at which the viscous vessels fit their ends.
//!
//! Each end gives a flow that is linear in the pressures of its tube's nodes ([`super::viscous`]); nodes ask for what
//! [`super::node`] says, narrowings for their loss, whose square is found by Newton's method. Next file to read: [`super::step`].

use nalgebra::{DMatrix, DVector};

use super::Fault;
use super::network::End;
use super::vessels::Vessels;
use super::viscous::{Coupling, Viscous};

/// Newton's iterations for the flows through narrowings at most.
const MOST: usize = 50;
/// Change of a flow, relative and in cm³/s, at which they have converged.
const CONVERGED: f64 = 1e-12;

impl Vessels<'_> {
    /// The pressures of the nodes, then the flows through narrowings, at the end of an implicit step of τ.
    ///
    /// # Errors
    /// When there are none.
    pub(super) fn node_pressures(
        &self,
        tau: f64,
        inflow: &[f64],
        x: &[f64],
        work: &Viscous,
    ) -> Result<DVector<f64>, Fault> {
        let (matrix, right) = self.balances(inflow, x, work);
        if self.losses.is_empty() {
            return solve(matrix, &right);
        }
        let mut flows = x[self.narrowed..][..self.losses.len()].to_vec();
        for _ in 0..MOST {
            let (mut matrix, mut right) = (matrix.clone(), right.clone());
            self.narrow(tau, x, &flows, work, &mut matrix, &mut right);
            let solved = solve(matrix, &right)?;
            let mut moved = 0.0_f64;
            for (flow, found) in flows.iter_mut().zip(solved.iter().skip(self.network.nodes.len())) {
                moved = moved.max((*found - *flow).abs() / (1.0 + found.abs()));
                *flow = *found;
            }
            if moved <= CONVERGED {
                return Ok(solved);
            }
        }
        Err(Fault::Network)
    }

    /// What the ends send to the nodes, as [`super::node::Condition`] asks.
    fn balances(&self, inflow: &[f64], x: &[f64], work: &Viscous) -> (DMatrix<f64>, DVector<f64>) {
        let (nodes, tubes) = (&self.network.nodes, &self.network.tubes);
        let (n, size) = (self.network.n_cell, nodes.len() + self.losses.len());
        let mut matrix = DMatrix::<f64>::zeros(size, size);
        let mut right = DVector::<f64>::zeros(size);
        for (row, node) in nodes.iter().enumerate() {
            let m = node.outlet.map_or(1.0, |i| self.outlets[i].proximal);
            if let Some(i) = node.inlet {
                right[row] -= inflow[i];
            }
            if let Some(i) = node.outlet {
                matrix[(row, row)] -= 1.0;
                right[row] -= self.behind(self.outlets[i], x);
            }
            for &end in &node.ends {
                let End { tube, sign } = end;
                let cell = tubes[tube].first + if sign > 0.0 { tubes[tube].n - 1 } else { 0 };
                let Coupling { pressure, slope, mobility } = work.couplings[end.index()];
                let weight = m * (sign + slope * mobility);
                for (side, &other) in tubes[tube].nodes.iter().enumerate() {
                    matrix[(row, other)] += weight * work.response[side][cell];
                }
                matrix[(row, row)] -= m * mobility;
                right[row] -= weight * work.free[cell] + m * mobility * (pressure - slope * x[n + cell]);
            }
        }
        (matrix, right)
    }

    /// The flows through narrowings in the balances of their two nodes, and l q + τ (a q + b |q| q − P_1 + P_2) = l r with the
    /// viscous parts of the pressures, linear around `flows`.
    fn narrow(
        &self,
        tau: f64,
        x: &[f64],
        flows: &[f64],
        work: &Viscous,
        matrix: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
    ) {
        for (k, (loss, narrowing)) in self.losses.iter().zip(&self.network.narrowings).enumerate() {
            let (row, flow) = (self.network.nodes.len() + k, flows[k]);
            matrix[(row, row)] = loss.inertance + tau * loss.slope(flow);
            right[row] = loss.inertance * x[self.narrowed + k] + tau * loss.turbulent * flow.abs() * flow;
            for (&node, sign) in narrowing.nodes.iter().zip([-1.0, 1.0]) {
                let end = self.network.nodes[node].ends[0];
                matrix[(node, row)] += sign;
                matrix[(row, node)] += sign * tau;
                right[row] += sign * tau * work.couplings[end.index()].pressure;
            }
        }
    }
}

fn solve(matrix: DMatrix<f64>, right: &DVector<f64>) -> Result<DVector<f64>, Fault> {
    let solved = matrix.lu().solve(right).filter(|p: &DVector<f64>| p.iter().all(|p| p.is_finite()));
    solved.ok_or(Fault::Network)
}
