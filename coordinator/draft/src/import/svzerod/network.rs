//! The network that the blocks of a file make: elements between nodes, in the terms of `rcr-network`.
//!
//! Two things that svZeroDSolver solves as differential-algebraic equations are put in another form here, and noted: a
//! capacitor whose pressure a source prescribes, and nodes whose pressure only inertances determine; an inertance behind a flow source is
//! put in another form by [`super::driven`]. Next file to read: [`super::layout`], which writes it.

use super::super::plan::Omission;
use crate::names::Names;

pub(super) use super::kind::{Chamber, Kind, Opening};

/// A node of the network: a position in the list of nodes.
pub(super) type Node = usize;
/// The node at zero pressure.
pub(super) const GROUND: Node = 0;

/// An element between two nodes.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) from: Node,
    pub(super) to: Node,
}

/// Times of one period in which a capacitor follows the pressure that a source prescribes, and the ringing of added elements
/// ends: far below what a file's sampling resolves.
const FAST: f64 = 1e-4;
/// Oscillations in a period of an inertance with what is added where it alone determines a pressure.
const RINGS: f64 = 1e3;

/// Elements between nodes.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) elements: Vec<Element>,
    nodes: Vec<String>,
    /// The node that each is one with.
    same: Vec<Node>,
    pub(super) names: Names,
    pub(super) notes: Vec<String>,
    pub(super) omissions: Vec<Omission>,
}

impl Network {
    pub(super) fn new() -> Self {
        let (nodes, same) = (vec!["0".to_owned()], vec![GROUND]);
        let (notes, omissions) = (Vec::new(), Vec::new());
        Self { elements: Vec::new(), nodes, same, names: Names::default(), notes, omissions }
    }

    /// A new node.
    pub(super) fn node(&mut self, wanted: &str) -> Node {
        self.nodes.push(self.names.take(wanted));
        self.same.push(self.nodes.len() - 1);
        self.nodes.len() - 1
    }

    /// The first element of a kind at a node.
    pub(super) fn at(&self, node: Node, kind: impl Fn(&Kind) -> bool) -> Option<&Element> {
        let root = self.root(node);
        self.elements.iter().find(|element| self.root(element.from) == root && kind(&element.kind))
    }

    /// The first of the nodes that are one with this.
    pub(super) fn root(&self, node: Node) -> Node {
        let mut node = node;
        while self.same[node] != node {
            node = self.same[node];
        }
        node
    }

    /// Makes two nodes one.
    pub(super) fn merge(&mut self, a: Node, b: Node) {
        let (a, b) = (self.root(a), self.root(b));
        self.same[a.max(b)] = a.min(b);
    }

    /// Name of a node; of those that are one, the first one's.
    pub(super) fn name(&self, node: Node) -> &str {
        &self.nodes[self.root(node)]
    }

    /// The name that a node had, where it is one with another by whose name it goes.
    pub(super) fn lost(&self, node: Node) -> Option<&str> {
        (self.root(node) != node).then(|| self.nodes[node].as_str())
    }

    /// Adds an element and gives its name.
    pub(super) fn add(&mut self, wanted: &str, kind: Kind, from: Node, to: Node) -> String {
        let name = self.names.take(wanted);
        self.elements.push(Element { name: name.clone(), kind, from, to });
        name
    }

    /// A node at a constant pressure.
    pub(super) fn constant(&mut self, wanted: &str, pressure: f64) -> Node {
        if pressure == 0.0 {
            return GROUND;
        }
        let node = self.node(&format!("{wanted}_end"));
        self.add(&format!("{wanted}_pressure"), Kind::Constant(pressure), GROUND, node);
        node
    }

    /// A resistance, a stenosis and an inertance in series, with a capacitor to the ground between the first two and the last;
    /// what is zero is left out.
    pub(super) fn series(
        &mut self,
        (name, place): (&str, &str),
        values: Series,
        from: Node,
        to: Node,
    ) -> Result<(), String> {
        let Series { resistance, stenosis, capacity, inertance } = values;
        for (what, value) in [("resistance", resistance), ("capacitance", capacity), ("inertance", inertance)]
        {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("{place}: {what} of `{name}` is {value}: give zero or more"));
            }
        }
        let given = stenosis;
        let stenosis = stenosis_of(resistance, given).ok_or_else(|| {
            format!("{place}: the stenosis coefficient of `{name}` is {given}: give zero or more")
        })?;
        let middle = match (resistance > 0.0 || stenosis > 0.0, inertance > 0.0) {
            (true, true) => self.node(&format!("{name}_mid")),
            (true, false) => to,
            (false, true) => from,
            (false, false) => {
                self.merge(from, to);
                from
            }
        };
        if stenosis > 0.0 {
            self.add(name, Kind::Loss { linear: resistance, quadratic: stenosis }, from, middle);
        } else if resistance > 0.0 {
            let element = self.add(name, Kind::Resistance(resistance), from, middle);
            if given < 0.0 {
                self.omissions.push(Omission {
                    output: format!("q_{element}"),
                    rate: -given / resistance,
                    what: format!("the stenosis coefficient of `{name}`"),
                    value: given,
                    place: place.to_owned(),
                });
            }
        }
        if capacity > 0.0 {
            let kind = Kind::Capacitor { value: capacity, outside: None };
            self.add(&format!("{name}_wall"), kind, middle, GROUND);
        }
        if inertance > 0.0 {
            self.add(&format!("{name}_blood"), Kind::Inertance(inertance), middle, to);
        }
        Ok(())
    }

    /// Puts into another form what `rcr-network` refuses and svZeroDSolver solves.
    pub(super) fn mend(&mut self, period: f64) {
        self.free_capacitors(period);
        self.determine(period);
    }

    /// Puts a small resistance before each capacitor at a node whose pressure a source prescribes.
    fn free_capacitors(&mut self, period: f64) {
        let prescribed: Vec<Node> = self
            .elements
            .iter()
            .filter_map(|element| match element.kind {
                Kind::Pressure | Kind::Constant(_) if self.root(element.from) == GROUND => {
                    Some(self.root(element.to))
                }
                Kind::Chamber(_) => Some(self.root(element.from)),
                _ => None,
            })
            .collect();
        for at in 0..self.elements.len() {
            let Element { name, kind, from, .. } = self.elements[at].clone();
            let Kind::Capacitor { value, .. } = kind else { continue };
            if !prescribed.contains(&self.root(from)) {
                continue;
            }
            let node = self.node(&format!("{name}_inside"));
            self.elements[at].from = node;
            self.add(&format!("{name}_entry"), Kind::Resistance(FAST * period / value), from, node);
            self.notes.push(format!(
                "a source or a chamber prescribes the pressure on the capacitor `{name}`: a small resistance `{name}_entry` stands before it"
            ));
        }
    }

    /// Gives every group of nodes whose pressure only inertances determine a small capacitor behind a resistance.
    fn determine(&mut self, period: f64) {
        let mut group: Vec<Node> = (0..self.nodes.len()).map(|node| self.root(node)).collect();
        for _ in 0..self.nodes.len() {
            let mut changed = false;
            for Element { kind, from, to, .. } in &self.elements {
                if matches!(kind, Kind::Inertance(_) | Kind::Flow) {
                    continue;
                }
                let (a, b) = (group[self.root(*from)], group[self.root(*to)]);
                if a != b {
                    group.iter_mut().filter(|g| **g == a.max(b)).for_each(|g| *g = a.min(b));
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        let of = |node: Node, network: &Self| group[network.root(node)];
        let mut groups: Vec<(Node, Node, f64)> = Vec::new();
        for Element { kind, from, to, .. } in &self.elements {
            let Kind::Inertance(value) = kind else { continue };
            for end in [*from, *to] {
                let own = of(end, self);
                if own == GROUND {
                    continue;
                }
                match groups.iter_mut().find(|(group, ..)| *group == own) {
                    Some((_, _, inverse)) => *inverse += 1.0 / value,
                    None => groups.push((own, end, 1.0 / value)),
                }
            }
        }
        for (_, node, inverse) in groups {
            let name = self.name(node).to_owned();
            // √(L/C) damps the ring of L and C within one of its periods.
            let rate = 2.0 * std::f64::consts::PI * RINGS / period;
            let (capacity, resistance) = (inverse / (rate * rate), rate / inverse);
            let store = self.node(&format!("{name}_store"));
            self.add(&format!("{name}_damping"), Kind::Resistance(resistance), node, store);
            let kind = Kind::Capacitor { value: capacity, outside: None };
            self.add(&format!("{name}_space"), kind, store, GROUND);
            self.notes.push(format!(
                "only inertances determine the pressure at `{name}`: `{name}_damping` and `{name}_space` are added there, which \
                 follow it within a thousandth of a period"
            ));
        }
    }
}

/// The coefficient of a stenosis, if it is one. Below zero, which fits of geometries give, it is left out and looked at when the
/// model has run.
fn stenosis_of(resistance: f64, value: f64) -> Option<f64> {
    let kept = value >= 0.0 || resistance > 0.0;
    (value.is_finite() && kept).then(|| value.max(0.0))
}

/// What stands in a row between two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Series {
    pub(super) resistance: f64,
    pub(super) stenosis: f64,
    pub(super) capacity: f64,
    pub(super) inertance: f64,
}

impl Series {
    /// Whether all of the flow passes without a drop of pressure.
    pub(super) fn is_nothing(&self) -> bool {
        [self.resistance, self.stenosis, self.inertance].iter().all(|value| *value == 0.0)
    }
}
