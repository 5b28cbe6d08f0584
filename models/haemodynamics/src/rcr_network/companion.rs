//! The network's equations with all of its variables, and the linear equations of an implicit step.
//!
//! Variables are the state, the pressures of groups of nodes, the flows through what stores and the flows through losses:
//! M z' = F(t, z) with M = 1 for the state and 0 else, of index 1 for every network that is not refused. A step solves
//! M/(γh) − ∂F/∂z. In it each element is a conductance, its companion (Nagel 1975): C/(γh) of a capacitor, γh/L of an inertance,
//! dq/dΔp of a resistance; what is left are the conductance equations of the groups, as sparse as the network. A loss is taken as a
//! pressure drop at its flow, which is smooth where the flow turns. Next file to read: [`super::factors`], which solves the linear
//! equations, then [`super::implicit`].

use super::circuit::{Circuit, Ends, Law, Tie, TieKind};
use super::laws::Valued;
use super::solve::{Solution, stored};
use super::sparse::{Edge, Pattern};
use super::topology::{Forest, Hop};

/// Where every element is in the equations.
#[derive(Clone, Debug)]
pub(super) struct Companion {
    pub(super) pattern: Pattern,
    /// Pressure sources, from a group's first node outwards.
    sources: Vec<Hop>,
    group: Vec<usize>,
    /// Ties with a state.
    pub(super) storages: Vec<Storage>,
    pub(super) inertances: Vec<Edge>,
    /// Resistances and valves.
    pub(super) conductors: Vec<(usize, Edge)>,
    pub(super) losses: Vec<(usize, Edge)>,
    injections: Vec<Edge>,
    n_state: usize,
    n_group: usize,
}

/// A tie with a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storage {
    pub(super) tie: usize,
    pub(super) state: usize,
    pub(super) edge: Edge,
    /// Unknown whose pressure presses on it, and the places of its ends' rows in that column.
    pub(super) around: Option<(usize, [Option<usize>; 2])>,
}

/// θ, and the signals with their rates at one time.
#[derive(Clone, Copy)]
pub(super) struct Moment<'a> {
    pub(super) theta: &'a [f64],
    pub(super) signals: &'a [f64],
    /// How fast signals change.
    pub(super) rates: &'a [f64],
    /// Slopes of the pressures around capacitors.
    pub(super) slopes: &'a [f64],
    /// The resistance that a branch has at least.
    pub(super) least: f64,
}

/// Variables, or what belongs to each of them, in parts.
pub(super) struct Parts<'a> {
    pub(super) state: &'a [f64],
    pub(super) pressure: &'a [f64],
    pub(super) stored: &'a [f64],
    pub(super) lost: &'a [f64],
}

/// The same, to be written.
pub(super) struct PartsMut<'a> {
    pub(super) state: &'a mut [f64],
    pub(super) pressure: &'a mut [f64],
    pub(super) stored: &'a mut [f64],
    pub(super) lost: &'a mut [f64],
}

impl Companion {
    pub(super) fn new(circuit: &Circuit) -> Self {
        let rigid = |tie: &Tie| matches!(tie.kind, TieKind::Pressure(_));
        let (forest, _) = Forest::over(circuit, &rigid);
        let group = forest.tree;
        let groups = |ends: Ends| [group[ends.from], group[ends.to]];
        let all = circuit.ties.iter().map(|b| b.ends).chain(circuit.resistive.iter().map(|b| b.ends));
        let all = all.chain(circuit.inertances.iter().map(|b| b.ends));
        let mut pairs: Vec<[usize; 2]> = all.map(groups).collect();
        for tie in &circuit.ties {
            if let TieKind::Under { around, .. } = &tie.kind {
                pairs.extend(groups(tie.ends).map(|end| [end, group[around.node]]));
            }
        }
        let pairs = pairs.into_iter().filter(|[a, b]| a.min(b) > &0).map(|[a, b]| (a - 1, b - 1));
        let pattern = Pattern::new(forest.n_tree - 1, pairs);
        let edge = |ends: Ends| Edge::new(&pattern, groups(ends));
        let branch = |loss: bool| {
            let kept = circuit.resistive.iter().enumerate();
            let kept = kept.filter(move |(_, b)| matches!(b.law, Law::Loss { .. }) == loss);
            kept.map(|(at, b)| (at, edge(b.ends))).collect::<Vec<_>>()
        };
        let storages = circuit.ties.iter().enumerate().filter_map(|(tie, b)| {
            let (state, around) = match &b.kind {
                TieKind::Capacitors { state, .. } | TieKind::Chamber { state, .. } => (*state, None),
                TieKind::Under { state, around, .. } => (*state, group[around.node].checked_sub(1)),
                TieKind::Pressure(_) => return None,
            };
            let edge = edge(b.ends);
            let around = around.map(|column| {
                (column, [edge.from, edge.to].map(|row| row.and_then(|row| pattern.place(row, column))))
            });
            Some(Storage { tie, state, edge, around })
        });
        Self {
            storages: storages.collect(),
            inertances: circuit.inertances.iter().map(|b| edge(b.ends)).collect(),
            conductors: branch(false),
            losses: branch(true),
            injections: circuit.injections.iter().map(|b| edge(b.ends)).collect(),
            n_state: circuit.n_state,
            n_group: forest.n_tree - 1,
            sources: forest.hops,
            pattern,
            group,
        }
    }

    /// Number of variables.
    pub(super) fn n_variable(&self) -> usize {
        self.n_state + self.n_group + self.storages.len() + self.losses.len()
    }

    /// The pressures and the flows among the variables that are no state.
    pub(super) fn beside<'a>(&self, z: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        z[self.n_state..].split_at(self.n_group)
    }

    pub(super) fn parts<'a>(&self, z: &'a [f64]) -> Parts<'a> {
        let (state, z) = z.split_at(self.n_state);
        let (pressure, z) = z.split_at(self.n_group);
        let (stored, lost) = z.split_at(self.storages.len());
        Parts { state, pressure, stored, lost }
    }

    pub(super) fn parts_mut<'a>(&self, z: &'a mut [f64]) -> PartsMut<'a> {
        let (state, z) = z.split_at_mut(self.n_state);
        let (pressure, z) = z.split_at_mut(self.n_group);
        let (stored, lost) = z.split_at_mut(self.storages.len());
        PartsMut { state, pressure, stored, lost }
    }

    /// Writes all variables for a state and the solution of its nodal equations.
    pub(super) fn variables(&self, x: &[f64], solution: &Solution, z: &mut [f64]) {
        let parts = self.parts_mut(z);
        parts.state.copy_from_slice(x);
        // The first node of a group is met first.
        for (group, pressure) in self.group.iter().zip(&solution.pressure).rev() {
            if let Some(at) = group.checked_sub(1) {
                parts.pressure[at] = *pressure;
            }
        }
        for (flow, storage) in parts.stored.iter_mut().zip(&self.storages) {
            *flow = solution.ties[storage.tie];
        }
        for (flow, (branch, _)) in parts.lost.iter_mut().zip(&self.losses) {
            *flow = solution.resistive[*branch];
        }
    }

    /// Writes each node's pressure above its group's first node for these levels of the sources.
    pub(super) fn offsets(&self, circuit: &Circuit, theta: &[f64], signals: &[f64], offsets: &mut [f64]) {
        offsets.fill(0.0);
        for hop in &self.sources {
            if let TieKind::Pressure(level) = circuit.ties[hop.tie].kind {
                offsets[hop.child] = offsets[hop.parent] + hop.sign * level.value(theta, signals);
            }
        }
    }

    /// Writes F; `offsets` belong to the same moment.
    pub(super) fn evaluate(
        &self,
        circuit: &Circuit,
        at: Moment<'_>,
        offsets: &[f64],
        z: &[f64],
        f: &mut [f64],
    ) {
        let (z, f) = (self.parts(z), self.parts_mut(f));
        let drop = |ends: Ends, edge: &Edge| offsets[ends.from] - offsets[ends.to] + edge.drop(z.pressure);
        f.pressure.fill(0.0);
        for ((storage, flow), gap) in self.storages.iter().zip(z.stored).zip(f.stored) {
            let (tie, held) = (&circuit.ties[storage.tie], z.state[storage.state]);
            let drop = drop(tie.ends, &storage.edge);
            storage.edge.leave(f.pressure, *flow);
            let rate = &mut f.state[storage.state];
            (*gap, *rate) = match &tie.kind {
                TieKind::Capacitors { parts, .. } => {
                    let (total, outside) = stored(parts, at.theta, at.slopes);
                    (held - drop, (flow + outside) / total)
                }
                TieKind::Under { compliance, share, around, .. } => {
                    let column = storage.around.map_or(0.0, |(column, _)| z.pressure[column]);
                    let around = offsets[around.node] + column;
                    (held - drop + at.theta[*share] * around, flow / at.theta[*compliance])
                }
                TieKind::Chamber { law, .. } => (law.at(at.theta, at.signals, held).pressure - drop, *flow),
                TieKind::Pressure(_) => continue,
            };
        }
        for (branch, edge) in circuit.inertances.iter().zip(&self.inertances) {
            f.state[branch.state] = drop(branch.ends, edge) / at.theta[branch.value];
            edge.leave(f.pressure, z.state[branch.state]);
        }
        let against = |at: Option<usize>, theta: &[f64]| at.map_or(0.0, |at| theta[at]);
        for (branch, edge) in &self.conductors {
            let branch = &circuit.resistive[*branch];
            let drop = drop(branch.ends, edge) - against(branch.against, at.theta);
            edge.leave(f.pressure, branch.law.valued(at.theta, at.least).at(drop).flow);
        }
        for (((branch, edge), flow), gap) in self.losses.iter().zip(z.lost).zip(f.lost) {
            let branch = &circuit.resistive[*branch];
            let (linear, quadratic) = loss(branch.law, at);
            let drop = drop(branch.ends, edge) - against(branch.against, at.theta);
            *gap = drop - (linear + quadratic * flow.abs()) * flow;
            edge.leave(f.pressure, *flow);
        }
        for (branch, edge) in circuit.injections.iter().zip(&self.injections) {
            edge.leave(f.pressure, at.signals[branch.signal]);
        }
    }

    /// Writes ∂F/∂t at a fixed z; `rates` are those of the offsets.
    pub(super) fn in_time(
        &self,
        circuit: &Circuit,
        at: Moment<'_>,
        [offsets, rates]: [&[f64]; 2],
        z: &[f64],
        f: &mut [f64],
    ) {
        f.fill(0.0);
        let (z, f) = (self.parts(z), self.parts_mut(f));
        let rate = |ends: Ends| rates[ends.from] - rates[ends.to];
        for (storage, gap) in self.storages.iter().zip(f.stored) {
            let tie = &circuit.ties[storage.tie];
            *gap = -rate(tie.ends);
            match &tie.kind {
                TieKind::Under { share, around, .. } => *gap += at.theta[*share] * rates[around.node],
                TieKind::Chamber { law, state } => {
                    let filled = law.at(at.theta, at.signals, z.state[*state]);
                    *gap += filled.by_activation * at.rates[law.activation];
                }
                TieKind::Capacitors { .. } | TieKind::Pressure(_) => {}
            }
        }
        for branch in &circuit.inertances {
            f.state[branch.state] = rate(branch.ends) / at.theta[branch.value];
        }
        for (branch, edge) in &self.conductors {
            let branch = &circuit.resistive[*branch];
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |against| at.theta[against]);
            let drop = offsets[from] - offsets[to] + edge.drop(z.pressure) - against;
            let conductance = branch.law.valued(at.theta, at.least).at(drop).conductance;
            edge.leave(f.pressure, conductance * rate(branch.ends));
        }
        for ((branch, _), gap) in self.losses.iter().zip(f.lost) {
            *gap = rate(circuit.resistive[*branch].ends);
        }
        for (branch, edge) in circuit.injections.iter().zip(&self.injections) {
            edge.leave(f.pressure, at.rates[branch.signal]);
        }
    }
}

/// Linear and quadratic part of a loss.
pub(super) fn loss(law: Law, at: Moment<'_>) -> (f64, f64) {
    match law.valued(at.theta, at.least) {
        Valued::Loss { linear, quadratic } => (linear, quadratic),
        _ => (f64::NAN, f64::NAN),
    }
}
