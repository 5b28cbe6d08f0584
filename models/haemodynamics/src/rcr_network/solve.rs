//! The nodal equations: node pressures and branch flows at one time, from the state and the signals.
//!
//! Unknown are the base pressures of the trees without the ground. They minimise the network's co-content (Millar 1951),
//! which is strictly convex, so there is exactly one solution; Newton's method with a search along each step finds it from
//! anywhere. The conductance matrix is symmetric positive definite. Next file to read: [`super::step`].

use nalgebra::{Cholesky, DMatrix, DVector};
use starlings_models_core::SetupError;

use super::circuit::{Circuit, Ends, FlowOf, TieKind};
use super::laws::Valued;
use super::topology::Forest;

/// Most Newton steps; about ten are taken.
const MAX_STEPS: usize = 200;
/// Most trials along one Newton step.
const MAX_TRIALS: usize = 60;
/// Part of the first slope that may be left at the end of a search.
const LEFT: f64 = 0.1;
/// Step, in parts of the pressures' size, below which only rounding keeps steps from getting shorter.
const SMALL: f64 = 1e-9;

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
            dx[branch.state] = solution.drop(branch.ends) / given.theta[branch.value];
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

/// First and second derivatives of the co-content in the unknown base pressures.
struct Expansion {
    /// Flow that leaves each tree.
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
        let mut last = f64::INFINITY;
        for _ in 0..MAX_STEPS {
            let here = self.expand(&base);
            let Some(matrix) = Cholesky::new(here.matrix) else { break };
            let step = -matrix.solve(&here.residual);
            let length = step.amax();
            let size = base.iter().fold(self.size, |size, p| size.max(p.abs()));
            let stalled = length <= SMALL * size && length >= 0.5 * last;
            if stalled || length <= 4.0 * f64::EPSILON * size {
                return go(&base, &step, 1.0);
            }
            base = self.search(here.residual.dot(&step), &step, &base);
            last = length;
        }
        vec![f64::NAN; n + 1]
    }

    /// Goes along a Newton step towards the least co-content. Its slope along the step grows from `first` < 0; a point is
    /// good when the slope is below a tenth of that. Illinois variant of regula falsi (Dowell & Jarratt 1971), safeguarded.
    ///
    /// Where losses dominate a full Newton step may lead just as far beyond the solution, to and fro for ever.
    fn search(&self, first: f64, step: &DVector<f64>, base: &[f64]) -> Vec<f64> {
        let enough = LEFT * first.abs();
        let mut at = go(base, step, 1.0);
        let mut slope = self.slope(step, &at);
        if slope <= enough {
            return at;
        }
        let (mut ends, mut slopes) = ([0.0, 1.0], [first, slope]);
        let mut last_side = None;
        for trial in 0..MAX_TRIALS {
            let guess = if trial % 4 == 3 { 0.5 } else { slopes[0] / (slopes[0] - slopes[1]) };
            let share = ends[0] + (ends[1] - ends[0]) * guess.clamp(1e-3, 1.0 - 1e-3);
            at = go(base, step, share);
            slope = self.slope(step, &at);
            if slope.abs() <= enough {
                break;
            }
            let side = usize::from(slope > 0.0);
            (ends[side], slopes[side]) = (share, slope);
            if last_side.replace(side) == Some(side) {
                slopes[1 - side] *= 0.5;
            }
        }
        at
    }

    /// Slope of the co-content along a step.
    fn slope(&self, step: &DVector<f64>, base: &[f64]) -> f64 {
        let along = |tree: usize| if tree == 0 { 0.0 } else { step[tree - 1] };
        let prescribed: f64 = self.prescribed.iter().enumerate().map(|(tree, flow)| flow * along(tree)).sum();
        let branches = self.branches.iter().map(|(ends, offset, law)| {
            law.at(offset + base[ends.from] - base[ends.to]).flow * (along(ends.from) - along(ends.to))
        });
        prescribed + branches.sum::<f64>()
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
        Expansion { residual, matrix }
    }
}

/// Base pressures after part of a step; the ground's stay.
fn go(base: &[f64], step: &DVector<f64>, share: f64) -> Vec<f64> {
    let moved = base[1..].iter().zip(step.iter()).map(|(base, step)| base + share * step);
    base[..1].iter().copied().chain(moved).collect()
}
