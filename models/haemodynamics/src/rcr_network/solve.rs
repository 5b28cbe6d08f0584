//! The nodal equations: node pressures and branch flows at one time, from the state and the signals.
//!
//! Unknown are the base pressures of the trees without the ground. They minimise the network's co-content (Millar 1951),
//! which is strictly convex, so there is exactly one solution; Newton's method with a search along each step finds it from
//! anywhere. The conductance matrix is symmetric positive definite and as sparse as the network. Next files to read:
//! [`super::nodal`], then [`super::step`], and [`super::implicit`] for networks that are not linear.

use starlings_models_core::SetupError;

use super::circuit::{Capacitor, Circuit, Ends, FlowOf, TieKind};
use super::companion::Companion;
use super::nodal::{Crossing, Nodal};
use super::sparse::{Edge, Pattern};
use super::topology::Forest;

/// A circuit that determines all its pressures and flows.
#[derive(Clone, Debug)]
pub(super) struct Network {
    pub(super) circuit: Circuit,
    /// What implicit steps need.
    pub(super) companion: Companion,
    forest: Forest,
    /// The nodal equations: an unknown per tree without the ground.
    pattern: Pattern,
    /// Per resistive branch its place among them.
    edges: Vec<Edge>,
}

/// Everything at one time.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// Per node, the ground first.
    pub(super) pressure: Vec<f64>,
    /// Flow per resistive branch.
    pub(super) resistive: Vec<f64>,
    /// Flow per tie, from → to.
    pub(super) ties: Vec<f64>,
}

impl Solution {
    /// p(from) − p(to).
    pub(super) fn drop(&self, ends: Ends) -> f64 {
        self.pressure[ends.from] - self.pressure[ends.to]
    }
}

/// State, parameters, and the signals with their time derivatives.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub(super) x: &'a [f64],
    pub(super) theta: &'a [f64],
    pub(super) signals: &'a [f64],
    pub(super) slopes: &'a [f64],
}

impl Network {
    /// # Errors
    /// When the circuit leaves a pressure or a flow undetermined, or determines one twice.
    pub(super) fn new(circuit: Circuit) -> Result<Self, SetupError> {
        let forest = Forest::new(&circuit)?;
        let companion = Companion::new(&circuit);
        let trees = circuit.resistive.iter().map(|b| [forest.tree[b.ends.from], forest.tree[b.ends.to]]);
        let pairs = trees.filter(|[a, b]| a.min(b) > &0).map(|[a, b]| (a - 1, b - 1));
        let pattern = Pattern::new(forest.n_tree - 1, pairs);
        let trees = circuit.resistive.iter().map(|b| [forest.tree[b.ends.from], forest.tree[b.ends.to]]);
        let edges = trees.map(|trees| Edge::new(&pattern, trees)).collect();
        Ok(Self { circuit, companion, forest, pattern, edges })
    }

    /// Solves the nodal equations; NaN where a value given is not finite.
    pub(super) fn solve(&self, given: Given<'_>) -> Solution {
        let mut leaving = self.prescribed(given);
        let mut pressure = self.offsets(given);
        let base = self.nodal(given.theta, &pressure, &leaving).solve();
        for (p, tree) in pressure.iter_mut().zip(&self.forest.tree) {
            *p += base[*tree];
        }
        let mut resistive = Vec::with_capacity(self.circuit.resistive.len());
        let least = self.circuit.least_resistance(given.theta);
        for branch in &self.circuit.resistive {
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |at| given.theta[at]);
            let law = branch.law.valued(given.theta, least);
            let flow = law.at(pressure[from] - pressure[to] - against).flow;
            leaving[from] += flow;
            leaving[to] -= flow;
            resistive.push(flow);
        }
        // From the leaves inwards: what leaves a node by other branches comes through the tie to its parent.
        let mut ties = vec![0.0; self.circuit.ties.len()];
        for hop in self.forest.hops.iter().rev() {
            ties[hop.tie] = hop.sign * leaving[hop.child];
            leaving[hop.parent] += leaving[hop.child];
        }
        Solution { pressure, resistive, ties }
    }

    /// Per node, the flow that leaves it by inertances and flow sources.
    fn prescribed(&self, given: Given<'_>) -> Vec<f64> {
        let mut leaving = vec![0.0; self.circuit.nodes.len()];
        let inertances = self.circuit.inertances.iter().map(|b| (b.ends, given.x[b.state]));
        let injections = self.circuit.injections.iter().map(|b| (b.ends, given.signals[b.signal]));
        for (ends, flow) in inertances.chain(injections) {
            leaving[ends.from] += flow;
            leaving[ends.to] -= flow;
        }
        leaving
    }

    /// Per node, its pressure above that of its tree's root.
    fn offsets(&self, given: Given<'_>) -> Vec<f64> {
        let mut pressure = vec![0.0; self.circuit.nodes.len()];
        for hop in &self.forest.hops {
            pressure[hop.child] = pressure[hop.parent] - hop.sign * self.tie_drop(hop.tie, given);
        }
        pressure
    }

    /// p(from) − p(to) of a tie.
    fn tie_drop(&self, tie: usize, given: Given<'_>) -> f64 {
        match &self.circuit.ties[tie].kind {
            TieKind::Capacitors { state, .. } => given.x[*state],
            TieKind::Under { state, share, around, .. } => {
                given.x[*state] + given.theta[*share] * self.tie_drop(around.tie, given)
            }
            TieKind::Chamber { state, law } => law.at(given.theta, given.signals, given.x[*state]).pressure,
            TieKind::Pressure(level) => -level.value(given.theta, given.signals),
        }
    }

    fn nodal(&self, theta: &[f64], offsets: &[f64], leaving: &[f64]) -> Nodal<'_> {
        let least = self.circuit.least_resistance(theta);
        let tree = &self.forest.tree;
        let mut prescribed = vec![0.0; self.forest.n_tree];
        for (node, flow) in leaving.iter().enumerate() {
            prescribed[tree[node]] += flow;
        }
        let branches = self.circuit.resistive.iter().zip(&self.edges).filter_map(|(branch, edge)| {
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |at| theta[at]);
            let offset = offsets[from] - offsets[to] - against;
            let crosses = tree[from] != tree[to];
            let ends = Ends { from: tree[from], to: tree[to] };
            crosses.then(|| Crossing { ends, offset, law: branch.law.valued(theta, least), edge })
        });
        let size = offsets.iter().fold(0.0, |size: f64, p| size.max(p.abs()));
        Nodal { branches: branches.collect(), prescribed, size, pattern: &self.pattern }
    }

    /// Writes the rate of the state.
    pub(super) fn rate(&self, given: Given<'_>, dx: &mut [f64]) {
        self.rate_of(&self.solve(given), given, dx);
    }

    /// The rate of the state for a solution at hand.
    pub(super) fn rate_of(&self, solution: &Solution, given: Given<'_>, dx: &mut [f64]) {
        for branch in &self.circuit.inertances {
            dx[branch.state] = solution.drop(branch.ends) / given.theta[branch.value];
        }
        for (tie, flow) in self.circuit.ties.iter().zip(&solution.ties) {
            match &tie.kind {
                TieKind::Capacitors { state, parts } => {
                    let (total, outside) = stored(parts, given.theta, given.slopes);
                    dx[*state] = (flow + outside) / total;
                }
                TieKind::Under { state, compliance, .. } => dx[*state] = flow / given.theta[*compliance],
                TieKind::Chamber { state, .. } => dx[*state] = *flow,
                TieKind::Pressure(_) => {}
            }
        }
    }

    /// The flow of an element, in its own direction.
    pub(super) fn flow(&self, of: FlowOf, solution: &Solution, given: Given<'_>, dx: &[f64]) -> f64 {
        match of {
            FlowOf::Resistive(at) => solution.resistive[at],
            FlowOf::Tie(at) => solution.ties[at],
            FlowOf::Inertance(at) => given.x[self.circuit.inertances[at].state],
            FlowOf::Injection(at) => given.signals[self.circuit.injections[at].signal],
            FlowOf::Capacitor(tie, part) => match &self.circuit.ties[tie].kind {
                TieKind::Capacitors { state, parts } => {
                    let part = &parts[part];
                    let outside = part.outside.map_or(0.0, |at| given.slopes[at]);
                    given.theta[part.compliance] * (part.sign * dx[*state] - outside)
                }
                _ => f64::NAN,
            },
        }
    }
}

/// The compliance of capacitors side by side, and the flow that pressures outside press out of them.
pub(super) fn stored(parts: &[Capacitor], theta: &[f64], slopes: &[f64]) -> (f64, f64) {
    let (mut total, mut flow) = (0.0, 0.0);
    for part in parts {
        let compliance = theta[part.compliance];
        total += compliance;
        flow += part.sign * compliance * part.outside.map_or(0.0, |at| slopes[at]);
    }
    (total, flow)
}
