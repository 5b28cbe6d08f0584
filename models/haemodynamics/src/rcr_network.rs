//! Zero-dimensional networks: resistances, capacitors, inertances, valves, Windkessels and losses, joined as a netlist says.
//!
//! The state holds the pressures of capacitors and the flows of inertances. All other pressures and flows follow from it
//! by the nodal equations at each time (Ho, Ruehli & Brennan 1975), which are solved whenever the rate or an output is
//! asked for: there is no differential-algebraic solver here, and networks that would need one of higher index are refused
//! with a remedy. A network of linear elements takes exact steps, others implicit ones on a sparse factorisation. Next file to
//! read: [`netlist`] for what a study writes, then [`solve`].

mod assembly;
mod chambers;
mod circuit;
mod companion;
mod elements;
mod factors;
mod implicit;
mod laws;
mod netlist;
mod nodal;
mod parameters;
mod shift;
mod solve;
mod sparse;
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
use implicit::Task;
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
    /// States of volumes that are outputs.
    volumes: Vec<usize>,
    /// Ends of the branches that switch, at zero pressure drop.
    valves: Vec<Ends>,
    /// Relative tolerance of the integration.
    tolerance: f64,
    /// How the span of one line of the signals is run.
    way: Way,
}

/// How a span is run on which every signal is linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// In one exact step.
    Exact,
    /// In implicit steps.
    Implicit,
    /// In steps that end where a sharp valve opens or closes, and where none does in implicit ones; beside chambers the control of the
    /// steps is left to find it.
    Events,
}

/// States of a linear network at most that it takes exact steps, whose cost grows with the third power.
const MOST_EXACT: usize = 64;

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
        let way = if assembly.circuit.is_linear() && assembly.circuit.n_state <= MOST_EXACT {
            Way::Exact
        } else if assembly.circuit.has_sharp_valves() && assembly.volumes.is_empty() {
            Way::Events
        } else {
            Way::Implicit
        };
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
            volumes: assembly.volumes.into_iter().map(|(_, state)| state).collect(),
            tolerance: netlist.tolerance,
            way,
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
        if self.way == Way::Events {
            let before = x.to_vec();
            match advance_by(self, self.solver(), segment, theta, x) {
                // A shut valve behind an inertance is so stiff that steps up to its kink may find none that ends there.
                Err(ModelFailure::NotFinite { .. } | ModelFailure::StepTooSmall { .. }) => {
                    x.copy_from_slice(&before);
                }
                done => return done,
            }
        }
        let length = segment.t1 - segment.t0;
        let end: Vec<f64> = segment.u0.iter().zip(segment.slope).map(|(u, s)| u + s * length).collect();
        let (slope, history) = (segment.slope, segment.history);
        let first = Drive { value: segment.u0, slope, history };
        let last = Drive { value: &end, slope, history };
        self.with_signals(segment.t0, theta, first, |start, slopes| {
            self.with_signals(segment.t1, theta, last, |end, _| {
                let span = Span { length, start, end, slopes };
                if self.way == Way::Exact {
                    step::exact(&self.network, theta, span, x);
                    return Ok(());
                }
                let (network, states, tolerance) = (&self.network, &self.spec.states[..], self.tolerance);
                let (limits, start) = (segment.limits, segment.t0);
                implicit::advance(Task { network, states, theta, tolerance, limits, start }, span, x)
            })
        })
    }
}

/// Pressure of every node, flow of every element, pressure drop of every loss, valve and gauge, volume of every chamber.
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
    let volumes = assembly
        .volumes
        .iter()
        .map(|(name, _)| quantity(format!("V_{name}"), Measure::Volume, format!("Volume of `{name}`.")));
    nodes.chain(flows).chain(drops).chain(volumes).collect()
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
            let volumes = self.volumes.iter().map(|state| x[*state]);
            for (y, value) in y.iter_mut().zip(pressures.chain(flows).chain(drops).chain(volumes)) {
                *y = value;
            }
        });
    }

    fn solver(&self) -> Solver {
        let tolerance = self.tolerance.min(1e-8);
        Solver::Auto(Tolerance { relative: tolerance, absolute: tolerance })
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
