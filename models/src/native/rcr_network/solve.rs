//! The nodal equations: node pressures and branch flows at one time, from the state and the signals.
//!
//! Unknown are the base pressures of the trees without the ground. They minimise the network's co-content (Millar 1951),
//! which is strictly convex, so there is exactly one solution; Newton's method with a line search on the co-content finds
//! it from anywhere. The conductance matrix is symmetric positive definite. Next file to read: [`super::step`].

use nalgebra::{Cholesky, DMatrix, DVector};

use super::circuit::{Circuit, Ends, FlowOf, TieKind};
use super::laws::Valued;
use super::topology::Forest;
use crate::SetupError;

/// Most Newton steps; quadratic convergence takes about five.
const MAX_STEPS: usize = 200;
/// Most halvings of one Newton step.
const MAX_HALVINGS: usize = 60;

/// A circuit that determines all its pressures and flows.
#[derive(Clone, Debug)]
pub(super) struct Network {
    pub(super) circuit: Circuit,
    forest: Forest,
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
        Ok(Self { circuit, forest })
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
        for branch in &self.circuit.resistive {
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |at| given.theta[at]);
            let flow = branch.law.valued(given.theta).at(pressure[from] - pressure[to] - against).flow;
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
            let drop = match &self.circuit.ties[hop.tie].kind {
                TieKind::Capacitors { state, .. } => given.x[*state],
                TieKind::Pressure(level) => -level.value(given.theta, given.signals),
            };
            pressure[hop.child] = pressure[hop.parent] - hop.sign * drop;
        }
        pressure
    }

    fn nodal(&self, theta: &[f64], offsets: &[f64], leaving: &[f64]) -> Nodal {
        let tree = &self.forest.tree;
        let mut prescribed = vec![0.0; self.forest.n_tree];
        for (node, flow) in leaving.iter().enumerate() {
            prescribed[tree[node]] += flow;
        }
        let branches = self.circuit.resistive.iter().filter_map(|branch| {
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |at| theta[at]);
            let offset = offsets[from] - offsets[to] - against;
            let crosses = tree[from] != tree[to];
            crosses.then(|| (Ends { from: tree[from], to: tree[to] }, offset, branch.law.valued(theta)))
        });
        let size = offsets.iter().fold(0.0, |size: f64, p| size.max(p.abs()));
        Nodal { branches: branches.collect(), prescribed, size }
    }

    /// Writes the rate of the state.
    pub(super) fn rate(&self, given: Given<'_>, dx: &mut [f64]) {
        self.rate_of(&self.solve(given), given, dx);
    }

    /// The rate of the state for a solution at hand.
    pub(super) fn rate_of(&self, solution: &Solution, given: Given<'_>, dx: &mut [f64]) {
        for branch in &self.circuit.inertances {
            dx[branch.state] = solution.drop(branch.ends) / given.theta[branch.inertance];
        }
        for (tie, flow) in self.circuit.ties.iter().zip(&solution.ties) {
            if let TieKind::Capacitors { state, parts } = &tie.kind {
                let (mut total, mut flow) = (0.0, *flow);
                for part in parts {
                    let compliance = given.theta[part.compliance];
                    total += compliance;
                    flow += part.sign * compliance * part.outside.map_or(0.0, |at| given.slopes[at]);
                }
                dx[*state] = flow / total;
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
                TieKind::Pressure(_) => f64::NAN,
            },
        }
    }
}

/// The network seen from the unknown base pressures: trees are its nodes.
struct Nodal {
    /// Ends, drop at zero base pressures, law.
    branches: Vec<(Ends, f64, Valued)>,
    /// Flow that leaves each tree whatever the pressures.
    prescribed: Vec<f64>,
    /// Size of the pressures.
    size: f64,
}

/// Co-content with its magnitude, and its first two derivatives in the unknown base pressures.
struct Expansion {
    co_content: f64,
    magnitude: f64,
    residual: DVector<f64>,
    matrix: DMatrix<f64>,
}

impl Nodal {
    /// The base pressures of all trees, that of the ground's first.
    fn solve(&self) -> Vec<f64> {
        let n = self.prescribed.len() - 1;
        let mut base = vec![0.0; n + 1];
        if n == 0 {
            return base;
        }
        for _ in 0..MAX_STEPS {
            let here = self.expand(&base);
            let Some(matrix) = Cholesky::new(here.matrix.clone()) else { break };
            let step = -matrix.solve(&here.residual);
            let size = base.iter().fold(self.size, |size, p| size.max(p.abs()));
            let done = step.amax() <= 4.0 * f64::EPSILON * size;
            if !self.search(&here, &step, &mut base) {
                break;
            }
            if done {
                return base;
            }
        }
        vec![f64::NAN; n + 1]
    }

    /// Goes along a Newton step as far as the co-content falls (Armijo 1966), but for rounding; says whether it could.
    fn search(&self, here: &Expansion, step: &DVector<f64>, base: &mut [f64]) -> bool {
        let slope = here.residual.dot(step);
        let slack = 1e-14 * here.magnitude;
        let start = base.to_vec();
        let mut share = 1.0;
        for _ in 0..MAX_HALVINGS {
            for (b, (start, step)) in base[1..].iter_mut().zip(start[1..].iter().zip(step.iter())) {
                *b = start + share * step;
            }
            if self.co_content(base).0 <= here.co_content + 1e-4 * share * slope + slack {
                return true;
            }
            share *= 0.5;
        }
        false
    }

    /// Co-content and the sum of its parts' magnitudes.
    fn co_content(&self, base: &[f64]) -> (f64, f64) {
        let prescribed = self.prescribed.iter().zip(base).map(|(flow, base)| flow * base);
        let branches =
            self.branches.iter().map(|(ends, at, law)| law.at(at + base[ends.from] - base[ends.to]).co_content);
        prescribed.chain(branches).fold((0.0, 0.0), |(sum, size), part| (sum + part, size + part.abs()))
    }

    fn expand(&self, base: &[f64]) -> Expansion {
        let n = base.len() - 1;
        let mut residual = DVector::from_column_slice(&self.prescribed[1..]);
        let mut matrix = DMatrix::zeros(n, n);
        for (ends, offset, law) in &self.branches {
            let at = law.at(offset + base[ends.from] - base[ends.to]);
            let (from, to) = (ends.from.checked_sub(1), ends.to.checked_sub(1));
            if let Some(i) = from {
                residual[i] += at.flow;
                matrix[(i, i)] += at.conductance;
            }
            if let Some(j) = to {
                residual[j] -= at.flow;
                matrix[(j, j)] += at.conductance;
            }
            if let (Some(i), Some(j)) = (from, to) {
                matrix[(i, j)] -= at.conductance;
                matrix[(j, i)] -= at.conductance;
            }
        }
        let (co_content, magnitude) = self.co_content(base);
        Expansion { co_content, magnitude, residual, matrix }
    }
}
