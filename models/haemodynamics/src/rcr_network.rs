//! Zero-dimensional networks: resistances, capacitors, inertances, valves, Windkessels and losses, joined as a netlist says.
//!
//! The state holds the pressures of capacitors and the flows of inertances. All other pressures and flows follow from it
//! by the nodal equations at each time (Ho, Ruehli & Brennan 1975), which are solved whenever the rate or an output is
//! asked for: there is no differential-algebraic solver here, and networks that would need one of higher index are refused
//! with a remedy. A network of linear elements takes exact steps. Next file to read: [`netlist`] for what a study writes,
//! then [`solve`].

mod assembly;
mod circuit;
mod elements;
mod laws;
mod netlist;
mod parameters;
mod shift;
mod solve;
mod step;
mod topology;
mod units;

use starlings_models_core::integrate::{Solver, Tolerance};
use starlings_models_core::segment::Segment;
use starlings_models_core::{
    Drive, Model, ModelDef, ModelFailure, Quantity, SetupError, Spec, advance_by, layout,
};

use assembly::Assembly;
use circuit::{Ends, FlowOf, Law};
use netlist::Netlist;
use shift::Source;
use solve::{Given, Network};
use step::Span;
use units::Measure;

/// A network of elements between nodes.
struct RcrNetwork {
    spec: Spec,
    network: Network,
    sources: Vec<Source>,
    initial: Vec<f64>,
    flows: Vec<FlowOf>,
    /// Pressure differences that are outputs.
    drops: Vec<Ends>,
    /// Ends of the branches that switch, at zero pressure drop.
    valves: Vec<Ends>,
}

/// Builds the network of a layout.
///
/// # Errors
/// When the netlist names something unknown or twice, or does not determine every pressure and flow once.
pub(super) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    Ok(Box::new(RcrNetwork::new(&layout::read::<Netlist>(def)?)?))
}

impl RcrNetwork {
    fn new(netlist: &Netlist) -> Result<Self, SetupError> {
        let assembly = Assembly::new(netlist)?;
        let outputs = outputs(&assembly);
        let network = Network::new(assembly.circuit)?;
        let valves = network.circuit.resistive.iter().filter_map(|branch| match branch.law {
            Law::Diode { smooth, .. } if smooth <= 0.0 => Some(branch.ends),
            _ => None,
        });
        Ok(Self {
            spec: Spec {
                kind: "rcr-network".to_owned(),
                says:
                    "A network of resistances, capacitors, inertances, valves and Windkessels from a netlist."
                        .to_owned(),
                states: assembly.states,
                parameters: assembly.parameters.into_quantities(),
                outputs,
                inputs: assembly.inputs,
                measures: assembly.measures,
                restart: true,
            },
            valves: valves.collect(),
            network,
            sources: assembly.sources,
            initial: assembly.initial,
            flows: assembly.flows.into_iter().map(|(_, flow)| flow).collect(),
            drops: assembly.drops.into_iter().map(|(_, ends)| ends).collect(),
        })
    }

    /// Calls with the signals and their slopes at time `t`.
    fn with_signals<T>(
        &self,
        t: f64,
        theta: &[f64],
        u: Drive<'_>,
        call: impl FnOnce(&[f64], &[f64]) -> T,
    ) -> T {
        let n = self.sources.len();
        let mut both = vec![0.0; 2 * n];
        let (values, slopes) = both.split_at_mut(n);
        shift::read(&self.sources, t, theta, u, values, slopes);
        call(values, slopes)
    }

    /// Advances over a span on which every signal is linear.
    fn advance_straight(
        &self,
        segment: Segment<'_>,
        theta: &[f64],
        x: &mut [f64],
    ) -> Result<(), ModelFailure> {
        if !self.network.circuit.is_linear() {
            return advance_by(self, self.solver(), segment, theta, x);
        }
        let length = segment.t1 - segment.t0;
        let end: Vec<f64> = segment.u0.iter().zip(segment.slope).map(|(u, s)| u + s * length).collect();
        let (slope, history) = (segment.slope, segment.history);
        let first = Drive { value: segment.u0, slope, history };
        let last = Drive { value: &end, slope, history };
        self.with_signals(segment.t0, theta, first, |start, slopes| {
            self.with_signals(segment.t1, theta, last, |end, _| {
                step::exact(&self.network, theta, Span { length, start, end, slopes }, x);
            });
        });
        Ok(())
    }
}

/// Pressure of every node, flow of every element, pressure drop of every loss, valve and gauge.
fn outputs(assembly: &Assembly) -> Vec<Quantity> {
    let quantity = |name: String, measure: Measure, says: String| {
        Quantity::new(&name, measure.label(assembly.units)).role(measure.role()).says(&says)
    };
    let nodes = assembly.circuit.nodes[1..]
        .iter()
        .map(|node| quantity(format!("p_{node}"), Measure::Pressure, format!("Pressure at node `{node}`.")));
    let flows = assembly.flows.iter().map(|(name, _)| {
        quantity(format!("q_{name}"), Measure::Flow, format!("Flow through `{name}` in its own direction."))
    });
    let drops = assembly.drops.iter().map(|(name, _)| {
        quantity(format!("dp_{name}"), Measure::Pressure, format!("Pressure drop `{name}`."))
    });
    nodes.chain(flows).chain(drops).collect()
}

impl Model for RcrNetwork {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.copy_from_slice(&self.initial);
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        self.with_signals(t, theta, u, |signals, slopes| {
            self.network.rate(Given { x, theta, signals, slopes }, dx);
        });
    }

    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        self.with_signals(t, theta, u, |signals, slopes| {
            let given = Given { x, theta, signals, slopes };
            let solution = self.network.solve(given);
            let mut dx = vec![0.0; x.len()];
            self.network.rate_of(&solution, given, &mut dx);
            let pressures = solution.pressure[1..].iter().copied();
            let flows = self.flows.iter().map(|of| self.network.flow(*of, &solution, given, &dx));
            let drops = self.drops.iter().map(|ends| solution.drop(*ends));
            for (y, value) in y.iter_mut().zip(pressures.chain(flows).chain(drops)) {
                *y = value;
            }
        });
    }

    fn solver(&self) -> Solver {
        Solver::Auto(Tolerance { relative: 1e-8, absolute: 1e-8 })
    }

    fn n_switch(&self) -> usize {
        self.valves.len()
    }

    fn switches(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, g: &mut [f64]) {
        if self.valves.is_empty() {
            return;
        }
        self.with_signals(t, theta, u, |signals, slopes| {
            let solution = self.network.solve(Given { x, theta, signals, slopes });
            for (g, ends) in g.iter_mut().zip(&self.valves) {
                *g = solution.drop(*ends);
            }
        });
    }

    /// Spans end where a shifted signal bends, so that no step runs across a bend.
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        if self.sources.iter().all(|source| source.shift.is_none()) {
            return self.advance_straight(segment, theta, x);
        }
        let mut u0 = segment.u0.to_vec();
        for ends in shift::bends(&self.sources, segment, theta).windows(2) {
            for ((u, first), slope) in u0.iter_mut().zip(segment.u0).zip(segment.slope) {
                *u = first + slope * (ends[0] - segment.t0);
            }
            let piece = Segment { t0: ends[0], t1: ends[1], u0: &u0, ..segment };
            self.advance_straight(piece, theta, x)?;
        }
        Ok(())
    }
}
