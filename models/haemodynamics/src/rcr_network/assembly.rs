//! From the netlist to the circuit: names become positions, and what the netlist says wrongly is refused at its place.
//!
//! Next file to read: [`super::elements`], which adds one element; then [`super::circuit`].

use starlings_models_core::layout::fault;
use starlings_models_core::{Quantity, SetupError, did_you_mean, meant, nearest, quoted_list};

use super::circuit::{Circuit, Ends, FlowOf, Resistive, Tie, TieKind};
use super::netlist::{Element, GROUND, Gauge, Kind, Netlist};
use super::parameters::{Parameters, identifier};
use super::shift::Source;
use super::units::{Measure, System};

/// A circuit with the quantities of the model around it.
pub(super) struct Assembly {
    pub(super) circuit: Circuit,
    pub(super) parameters: Parameters,
    pub(super) states: Vec<Quantity>,
    pub(super) initial: Vec<f64>,
    pub(super) inputs: Vec<Quantity>,
    /// The circuit's signals.
    pub(super) sources: Vec<Source>,
    /// Flow of every element, in the order of the netlist.
    pub(super) flows: Vec<(String, FlowOf)>,
    /// Pressure differences that are outputs.
    pub(super) drops: Vec<(String, Ends)>,
    /// Volumes that are outputs, with their states.
    pub(super) volumes: Vec<(String, usize)>,
    /// Pairs of an output and the state that it measures.
    pub(super) measures: Vec<(String, String)>,
    pub(super) units: System,
    /// Pressures at the start that the node list gives, and their places.
    pub(super) node_initial: Vec<(usize, f64, String)>,
    /// Whether the netlist has a node list.
    declared: bool,
}

impl Assembly {
    /// # Errors
    /// When the netlist names something unknown or twice, or an element lacks or has what does not belong to it.
    pub(super) fn new(netlist: &Netlist) -> Result<Self, SetupError> {
        let mut assembly = Self::begin(netlist)?;
        if !(netlist.tolerance >= 1e-12 && netlist.tolerance <= 1e-2) {
            return Err(fault("tolerance", format!("{} is not between 1e-12 and 0.01", netlist.tolerance)));
        }
        if netlist.elements.is_empty() {
            return Err(fault("elements", "a network needs elements"));
        }
        for (i, element) in netlist.elements.iter().enumerate() {
            let path = format!("elements[{i}]");
            check_name(&element.name, "an element", &path)?;
            if netlist.elements[..i].iter().any(|other| other.name == element.name) {
                let message = format!("another element is named `{}`: names are unique", element.name);
                return Err(fault(&format!("{path}.name"), message));
            }
            check_keys(element, &path)?;
            assembly.add(element, &path)?;
        }
        if let Some((node, _, place)) = assembly.node_initial.first() {
            let message = format!(
                "node `{}` has no capacitor to the ground, so its pressure follows from the others': remove `initial`",
                assembly.circuit.nodes[*node]
            );
            return Err(fault(place, message));
        }
        assembly.find_chambers()?;
        assembly.check_ends(netlist)?;
        for (i, gauge) in netlist.gauges.iter().enumerate() {
            assembly.gauge(gauge, &format!("gauges[{i}]"))?;
        }
        Ok(assembly)
    }

    /// Adds a pressure difference between nodes that elements end at.
    fn gauge(&mut self, gauge: &Gauge, path: &str) -> Result<(), SetupError> {
        check_name(&gauge.name, "a gauge", path)?;
        if self.drops.iter().any(|(name, _)| *name == gauge.name) {
            let message = format!("there is a pressure drop `dp_{}` already: names are unique", gauge.name);
            return Err(fault(&format!("{path}.name"), message));
        }
        let find = |name: &String, end: &str| {
            self.circuit.nodes.iter().position(|node| node == name).ok_or_else(|| {
                let near = meant(nearest(name, &self.circuit.nodes));
                let message = format!("no node named `{name}`{near}");
                fault(&format!("{path}.{end}"), message)
            })
        };
        let ends = Ends { from: find(&gauge.from, "from")?, to: find(&gauge.to, "to")? };
        self.drops.push((gauge.name.clone(), ends));
        Ok(())
    }

    /// The ground and the declared nodes.
    fn begin(netlist: &Netlist) -> Result<Self, SetupError> {
        let mut circuit = Circuit::default();
        circuit.nodes.push(GROUND.to_owned());
        circuit.places.push("nodes".to_owned());
        let mut node_initial = Vec::new();
        for (i, node) in netlist.nodes.iter().enumerate() {
            let path = format!("nodes[{i}]");
            check_name(&node.name, "a node", &path)?;
            if node.name != GROUND && circuit.nodes.contains(&node.name) {
                let message = format!("another node is named `{}`: names are unique", node.name);
                return Err(fault(&format!("{path}.name"), message));
            }
            if node.name == GROUND {
                if node.initial.is_some() {
                    return Err(fault(&path, "the ground `0` is always at zero pressure: remove `initial`"));
                }
                continue;
            }
            if let Some(value) = node.initial {
                node_initial.push((circuit.nodes.len(), value, format!("{path}.initial")));
            }
            circuit.nodes.push(node.name.clone());
            circuit.places.push(path);
        }
        Ok(Self {
            circuit,
            parameters: Parameters::new(netlist.units),
            states: Vec::new(),
            initial: Vec::new(),
            inputs: Vec::new(),
            sources: Vec::new(),
            flows: Vec::new(),
            drops: Vec::new(),
            volumes: Vec::new(),
            measures: Vec::new(),
            units: netlist.units,
            node_initial,
            declared: !netlist.nodes.is_empty(),
        })
    }

    /// Position of the node at one end of an element; an end that is not written is the ground.
    pub(super) fn node(&mut self, name: Option<&String>, path: &str) -> Result<usize, SetupError> {
        let Some(name) = name else { return Ok(0) };
        if let Some(at) = self.circuit.nodes.iter().position(|node| node == name) {
            return Ok(at);
        }
        if self.declared {
            let near = meant(nearest(name, &self.circuit.nodes));
            let message = format!("no node named `{name}` in `nodes`{near}");
            return Err(fault(path, message));
        }
        check_name(name, "a node", path)?;
        self.circuit.nodes.push(name.clone());
        self.circuit.places.push(path.to_owned());
        Ok(self.circuit.nodes.len() - 1)
    }

    /// A node that belongs to an element.
    pub(super) fn chamber(&mut self, name: &str, path: &str) -> Result<usize, SetupError> {
        if self.circuit.nodes.iter().any(|node| node == name) {
            let message = format!(
                "the chamber of `{name}` is a node of that name, and there is a node `{name}` already: rename one of the two"
            );
            return Err(fault(path, message));
        }
        self.circuit.nodes.push(name.to_owned());
        self.circuit.places.push(path.to_owned());
        Ok(self.circuit.nodes.len() - 1)
    }

    /// A signal read from an input.
    pub(super) fn signal(
        &mut self,
        input: &str,
        measure: Measure,
        shift: Option<usize>,
        path: &str,
    ) -> Result<usize, SetupError> {
        if !identifier(input) {
            let message = format!("`{input}` is no name of an input: letters, digits and `_`");
            return Err(fault(path, message));
        }
        let input = match self.inputs.iter().position(|q| q.name == input) {
            Some(at) if self.inputs[at].role == measure.role() => at,
            Some(_) => {
                let message =
                    format!("the input `{input}` cannot be a pressure and a flow: give one another `input`");
                return Err(fault(path, message));
            }
            None => {
                let quantity = Quantity::new(input, measure.label(self.units)).role(measure.role());
                self.inputs.push(quantity.says(&format!("A {} that drives the network.", measure.word())));
                self.inputs.len() - 1
            }
        };
        self.sources.push(Source { input, shift });
        self.circuit.n_signal += 1;
        Ok(self.sources.len() - 1)
    }

    /// A state with its value at the start.
    pub(super) fn state(&mut self, quantity: Quantity, initial: f64) -> usize {
        self.states.push(quantity.default(initial));
        self.initial.push(initial);
        self.circuit.n_state += 1;
        self.circuit.n_state - 1
    }

    /// A branch with a law, the flow of the named element.
    pub(super) fn resistive(&mut self, branch: Resistive) -> usize {
        self.circuit.resistive.push(branch);
        self.circuit.resistive.len() - 1
    }

    /// Finds the chambers around capacitors.
    fn find_chambers(&mut self) -> Result<(), SetupError> {
        let chamber = |tie: &Tie| {
            (tie.ends.to == 0 && matches!(tie.kind, TieKind::Chamber { .. })).then_some(tie.ends.from)
        };
        let nodes: Vec<Option<usize>> = self.circuit.ties.iter().map(chamber).collect();
        for tie in &mut self.circuit.ties {
            let TieKind::Under { around, .. } = &mut tie.kind else { continue };
            around.tie = nodes.iter().position(|node| *node == Some(around.node)).ok_or_else(|| {
                let message = format!(
                    "no chamber to the ground is at node `{}`, so its pressure cannot press on `{}`",
                    self.circuit.nodes[around.node], tie.says
                );
                fault(&format!("{}.around", tie.path), message)
            })?;
        }
        Ok(())
    }

    /// Refuses an undeclared node that only one element ends at: most likely a misspelt one.
    fn check_ends(&self, netlist: &Netlist) -> Result<(), SetupError> {
        if self.declared {
            return Ok(());
        }
        for (name, place) in self.circuit.nodes.iter().zip(&self.circuit.places).skip(1) {
            let ends = netlist.elements.iter().flat_map(|e| [&e.from, &e.to, &e.around]);
            let count = ends.flatten().filter(|end| *end == name).count();
            if count == 1 {
                // The element's own other end cannot be meant: it would join a node with itself.
                let own = |e: &&Element| [&e.from, &e.to].into_iter().flatten().any(|end| end == name);
                let own: Vec<&String> =
                    netlist.elements.iter().filter(own).flat_map(|e| [&e.from, &e.to]).flatten().collect();
                let others = self.circuit.nodes.iter().filter(|node| !own.contains(node));
                let remedy = match nearest(name, others) {
                    Some(near) => format!("{} Otherwise declare all nodes in `nodes`", did_you_mean(near)),
                    None => "if that is meant, declare all nodes in `nodes`".to_owned(),
                };
                let message = format!("only one element ends at node `{name}`: {remedy}");
                return Err(fault(place, message));
            }
        }
        Ok(())
    }
}

fn check_name(name: &str, what: &str, path: &str) -> Result<(), SetupError> {
    if identifier(name) {
        return Ok(());
    }
    let message = format!("`{name}` is no name of {what}: letters, digits and `_`");
    Err(fault(&format!("{path}.name"), message))
}

/// Refuses keys of other kinds of elements, and ends that make no branch.
fn check_keys(element: &Element, path: &str) -> Result<(), SetupError> {
    let (kind, keys) = (element.kind, element.kind.keys());
    if let Some(key) = element.written().into_iter().find(|key| !keys.contains(key)) {
        let has = quoted_list(keys);
        let message = format!("an element of kind `{}` has no `{key}` (it has {has})", kind.word());
        return Err(fault(&format!("{path}.{key}"), message));
    }
    let ground = GROUND.to_owned();
    let (from, to) = (element.from.as_ref().unwrap_or(&ground), element.to.as_ref().unwrap_or(&ground));
    if from == to {
        let message = if element.from.is_none() || element.to.is_none() {
            let key = if matches!(kind, Kind::Flow | Kind::Pressure) { "to" } else { "from" };
            format!("`{}` needs `{key}`, the node it is joined to", element.name)
        } else {
            format!("both ends of `{}` are node `{from}`: an element joins two nodes", element.name)
        };
        return Err(fault(path, message));
    }
    if let Some(steepness) = element.steepness.filter(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(fault(&format!("{path}.steepness"), format!("{steepness} is not above zero")));
    }
    if element.steepness.is_some() && element.smooth.is_some() {
        return Err(fault(
            path,
            "a valve opens over a drop (`smooth`) or by `steepness`: remove one of the two",
        ));
    }
    let smooth = element.smooth.unwrap_or(0.0);
    if !(smooth >= 0.0 && smooth.is_finite()) {
        return Err(fault(&format!("{path}.smooth"), "must be zero or a positive pressure"));
    }
    match element.initial {
        Some(value) if !value.is_finite() => Err(fault(&format!("{path}.initial"), "must be finite")),
        _ => Ok(()),
    }
}
