//! The linear equations of an implicit step, M/(γh) − ∂F/∂z, factorised once for all its stages.
//!
//! Next file to read: [`super::sparse`].

use super::circuit::{Circuit, Ends, TieKind};
use super::companion::{Companion, Moment, loss};
use super::solve::stored;

/// The factorised equations of one step.
#[derive(Default)]
pub(super) struct Factors {
    matrix: Vec<f64>,
    /// Per storage, its conductance, its store per unit of state, ∂p/∂state and share of the pressure around it.
    storages: Vec<[f64; 4]>,
    /// Per loss, dq/dΔp.
    losses: Vec<f64>,
    /// γh/L.
    inertances: Vec<f64>,
    /// γh.
    span: f64,
}

impl Companion {
    /// Factorises M/(γh) − ∂F/∂z; says whether that could be done.
    pub(super) fn factorise(
        &self,
        circuit: &Circuit,
        at: Moment<'_>,
        offsets: &[f64],
        z: &[f64],
        span: f64,
        factors: &mut Factors,
    ) -> bool {
        let z = self.parts(z);
        let matrix = &mut factors.matrix;
        matrix.clear();
        matrix.resize(self.pattern.n_place(), 0.0);
        factors.span = span;
        factors.storages.clear();
        for storage in &self.storages {
            let (store, elastance, share) = match &circuit.ties[storage.tie].kind {
                TieKind::Capacitors { parts, .. } => (stored(parts, at.theta, at.slopes).0, 1.0, 0.0),
                TieKind::Under { compliance, share, .. } => (at.theta[*compliance], 1.0, at.theta[*share]),
                TieKind::Chamber { law, state } => {
                    (1.0, law.at(at.theta, at.signals, z.state[*state]).elastance, 0.0)
                }
                TieKind::Pressure(_) => continue,
            };
            let conductance = store / (elastance * span);
            storage.edge.stamp(matrix, conductance);
            for (place, sign) in storage.around.iter().flat_map(|(_, rows)| rows.iter().zip([-1.0, 1.0])) {
                if let Some(place) = place {
                    matrix[*place] += sign * share * conductance;
                }
            }
            factors.storages.push([conductance, store, elastance, share]);
        }
        factors.inertances.clear();
        for (branch, edge) in circuit.inertances.iter().zip(&self.inertances) {
            let conductance = span / at.theta[branch.value];
            edge.stamp(matrix, conductance);
            factors.inertances.push(conductance);
        }
        for (branch, edge) in &self.conductors {
            let branch = &circuit.resistive[*branch];
            let Ends { from, to } = branch.ends;
            let against = branch.against.map_or(0.0, |against| at.theta[against]);
            let drop = offsets[from] - offsets[to] + edge.drop(z.pressure) - against;
            edge.stamp(matrix, branch.law.valued(at.theta, at.least).at(drop).conductance);
        }
        factors.losses.clear();
        for ((branch, edge), flow) in self.losses.iter().zip(z.lost) {
            let (linear, quadratic) = loss(circuit.resistive[*branch].law, at);
            let conductance = 1.0 / (linear + 2.0 * quadratic * flow.abs());
            edge.stamp(matrix, conductance);
            factors.losses.push(conductance);
        }
        self.pattern.factorise(matrix)
    }

    /// Solves the factorised equations in place of their right-hand side.
    pub(super) fn solve(&self, circuit: &Circuit, factors: &Factors, r: &mut [f64]) {
        let r = self.parts_mut(r);
        for leaving in r.pressure.iter_mut() {
            *leaving = -*leaving;
        }
        for ((storage, [conductance, store, ..]), gap) in
            self.storages.iter().zip(&factors.storages).zip(&*r.stored)
        {
            let known = -conductance * gap - store * r.state[storage.state];
            storage.edge.leave(r.pressure, -known);
        }
        for (branch, edge) in circuit.inertances.iter().zip(&self.inertances) {
            edge.leave(r.pressure, -factors.span * r.state[branch.state]);
        }
        for (((_, edge), conductance), gap) in self.losses.iter().zip(&factors.losses).zip(&*r.lost) {
            edge.leave(r.pressure, -conductance * gap);
        }
        self.pattern.solve(&factors.matrix, r.pressure);
        for ((storage, [conductance, store, elastance, share]), flow) in
            self.storages.iter().zip(&factors.storages).zip(r.stored)
        {
            let around = storage.around.map_or(0.0, |(column, _)| r.pressure[column]);
            let drop = storage.edge.drop(r.pressure) - share * around - *flow;
            let state = &mut r.state[storage.state];
            *flow = conductance * drop - store * *state;
            *state = drop / elastance;
        }
        for ((branch, edge), conductance) in
            circuit.inertances.iter().zip(&self.inertances).zip(&factors.inertances)
        {
            let state = &mut r.state[branch.state];
            *state = factors.span * *state + conductance * edge.drop(r.pressure);
        }
        for (((_, edge), conductance), flow) in self.losses.iter().zip(&factors.losses).zip(r.lost) {
            *flow = conductance * (edge.drop(r.pressure) + *flow);
        }
    }
}
