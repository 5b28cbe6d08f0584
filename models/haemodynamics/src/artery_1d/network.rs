//! The network that a layout makes: tubes of one stiffness each, cut into cells, and the nodes at which they end.
//!
//! A vessel with several regions becomes a chain of tubes, so that a jump of stiffness lies on a node, where mass and total
//! pressure are continuous whatever the walls on its two sides. Next file to read: [`super::vessels`], which gives the
//! network the values of the parameters.

use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

use super::checks;
use super::layout::{Friction, Layout, NodeKind, Segment, StiffnessParameter, WallLaw, stiffness_parameter};

/// A tube of one parameter of stiffness.
#[derive(Debug)]
pub(super) struct Tube {
    /// Number of its first cell in the network.
    pub(super) first: usize,
    /// Number of cells.
    pub(super) n: usize,
    /// Length of a cell in cm.
    pub(super) dx: f64,
    /// R0 at the n + 1 faces of the cells in cm.
    pub(super) radius: Vec<f64>,
    /// Wall thickness at the faces in cm.
    pub(super) thickness: Vec<f64>,
    /// E h/R0 by R0, where a law says it.
    pub(super) wall: Option<WallLaw>,
    /// Friction relative to that of a parabolic profile, (ζ + 2)/4.
    pub(super) friction: f64,
    /// Number of its first cell among those whose wall shear remembers, where it does.
    pub(super) memory: Option<usize>,
    /// Nodes at the start and at the end.
    pub(super) nodes: [usize; 2],
}

/// Where a tube meets a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    /// The tube.
    pub(super) tube: usize,
    /// 1 where the tube ends in the node, −1 where it starts there: flow times this is flow into the node.
    pub(super) sign: f64,
}

impl End {
    /// Number of this end among all ends of the network.
    pub(super) fn index(self) -> usize {
        2 * self.tube + usize::from(self.sign > 0.0)
    }
}

/// A node and the ends of tubes in it.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) kind: NodeKind,
    pub(super) ends: Vec<End>,
    /// Number among the inlets, where it is one.
    pub(super) inlet: Option<usize>,
    /// Number among the outlets, where it is one.
    pub(super) outlet: Option<usize>,
    /// Number of the narrowing of which it is a side, where it is one, and 1 where its flow enters there, −1 where it leaves.
    pub(super) narrowing: Option<(usize, f64)>,
}

/// What lies between the two nodes of a stenosis.
#[derive(Debug)]
pub(super) struct Narrowing {
    /// Its nodes; flow counts positive from the first to the second.
    pub(super) nodes: [usize; 2],
    /// Length L in cm.
    pub(super) length: f64,
    /// R0 of the vessel around it in cm.
    pub(super) radius: f64,
}

impl Node {
    /// One without ends.
    fn new(name: &str, kind: NodeKind) -> Self {
        Self { name: name.to_owned(), kind, ends: Vec::new(), inlet: None, outlet: None, narrowing: None }
    }
}

/// The whole network.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) tubes: Vec<Tube>,
    pub(super) nodes: Vec<Node>,
    pub(super) n_cell: usize,
    /// Number of cells whose wall shear remembers.
    pub(super) n_memory: usize,
    /// The parameter of stiffness of each tube.
    pub(super) stiffnesses: Vec<StiffnessParameter>,
    /// The nodes of the inlets, in the order of the layout.
    pub(super) inlets: Vec<usize>,
    /// The nodes of the outlets, in the order of the layout.
    pub(super) outlets: Vec<usize>,
    /// The stenoses, in the order of the layout.
    pub(super) narrowings: Vec<Narrowing>,
}

impl Network {
    /// Makes the network of a layout.
    ///
    /// # Errors
    /// When a number is not positive or there are too many cells, a name is used twice or is none, or the vessels are no
    /// connected network between inlets and outlets.
    pub(super) fn new(layout: &Layout) -> Result<Self, SetupError> {
        checks::segments(&layout.segments)?;
        let mut network = Self::with_nodes(layout)?;
        for segment in &layout.segments {
            network.add(segment, layout.segments.len() == 1);
        }
        network.narrow(layout)?;
        network.check_nodes(layout)?;
        network.check_connected(layout)?;
        Ok(network)
    }

    /// Only the nodes: those that the layout lists, then the joints that vessels name.
    fn with_nodes(layout: &Layout) -> Result<Self, SetupError> {
        let (mut nodes, mut outlets, mut inlets) = (Vec::<Node>::new(), Vec::new(), Vec::new());
        for (i, entry) in layout.nodes.iter().enumerate() {
            let path = format!("nodes[{i}].name");
            checks::name(&path, &entry.name)?;
            if nodes.iter().any(|node| node.name == entry.name) {
                return Err(fault(&path, format!("two nodes are called `{}`", entry.name)));
            }
            let mut node = Node::new(&entry.name, entry.kind);
            match entry.kind {
                NodeKind::Inlet => {
                    node.inlet = Some(inlets.len());
                    inlets.push(i);
                }
                NodeKind::Rcr | NodeKind::Resistance => {
                    node.outlet = Some(outlets.len());
                    outlets.push(i);
                }
                NodeKind::Junction | NodeKind::Stenosis => {}
            }
            nodes.push(node);
        }
        if inlets.is_empty() {
            return Err(fault("nodes", "no inlet: list a node of kind \"inlet\", where a flow enters"));
        }
        if outlets.is_empty() {
            return Err(fault("nodes", "no outlet: list a node of kind \"rcr\" or \"resistance\""));
        }
        Ok(Self {
            tubes: Vec::new(),
            nodes,
            n_cell: 0,
            n_memory: 0,
            stiffnesses: Vec::new(),
            inlets,
            outlets,
            narrowings: Vec::new(),
        })
    }

    /// The node of this name; a joint where there is none yet.
    fn node(&mut self, name: &str) -> usize {
        if let Some(found) = self.nodes.iter().position(|node| node.name == name) {
            return found;
        }
        self.nodes.push(Node::new(name, NodeKind::Junction));
        self.nodes.len() - 1
    }

    /// Adds a vessel as a chain of tubes, one per region.
    fn add(&mut self, segment: &Segment, alone: bool) {
        let (regions, n) = (segment.regions, segment.cells / segment.regions);
        let dx = segment.length / segment.cells as f64;
        let ends = |from: f64, to: Option<f64>| (from, to.unwrap_or(from));
        let (radius, thickness) =
            (ends(segment.radius, segment.radius_to), ends(segment.thickness, segment.thickness_to));
        let between = |(from, to): (f64, f64), face: usize| {
            let part = face as f64 / segment.cells as f64;
            (1.0 - part).mul_add(from, part * to)
        };
        let remembers = segment.friction == Friction::Womersley;
        let mut from = self.node(&segment.from);
        for region in 0..regions {
            let to = if region + 1 == regions {
                self.node(&segment.to)
            } else {
                // Not a name that a layout may use.
                self.node(&format!("{}:{}", segment.name, region + 1))
            };
            let tube = self.tubes.len();
            self.nodes[from].ends.push(End { tube, sign: -1.0 });
            self.nodes[to].ends.push(End { tube, sign: 1.0 });
            self.tubes.push(Tube {
                first: self.n_cell,
                n,
                dx,
                radius: (region * n..=(region + 1) * n).map(|face| between(radius, face)).collect(),
                thickness: (region * n..=(region + 1) * n).map(|face| between(thickness, face)).collect(),
                wall: segment.wall,
                friction: (segment.profile + 2.0) / 4.0,
                memory: remembers.then_some(self.n_memory),
                nodes: [from, to],
            });
            self.n_cell += n;
            self.n_memory += if remembers { n } else { 0 };
            self.stiffnesses.push(stiffness_parameter(segment, region, alone));
            from = to;
        }
    }

    /// Makes two nodes of each stenosis, one per end: the flow leaves the network at the first and enters at the second.
    fn narrow(&mut self, layout: &Layout) -> Result<(), SetupError> {
        for (i, entry) in layout.nodes.iter().enumerate() {
            let length = checks::stenosis(i, entry)?;
            let Some(length) = length else { continue };
            let [first, second] = self.nodes[i].ends[..] else {
                let message = format!(
                    "{} segments meet at `{}`: a stenosis joins exactly two",
                    self.nodes[i].ends.len(),
                    entry.name
                );
                return Err(fault(&format!("nodes[{i}].name"), message));
            };
            let (number, twin) = (self.narrowings.len(), self.nodes.len());
            let mut beyond = Node::new(&entry.name, NodeKind::Stenosis);
            beyond.ends.push(second);
            beyond.narrowing = Some((number, 1.0));
            self.nodes.push(beyond);
            self.nodes[i].ends.truncate(1);
            self.nodes[i].narrowing = Some((number, -1.0));
            self.tubes[second.tube].nodes[usize::from(second.sign > 0.0)] = twin;
            let radius = |end: End| {
                let along = &self.tubes[end.tube].radius;
                if end.sign > 0.0 { along[along.len() - 1] } else { along[0] }
            };
            let radius = 0.5 * (radius(first) + radius(second));
            self.narrowings.push(Narrowing { nodes: [i, twin], length, radius });
        }
        Ok(())
    }

    fn check_nodes(&self, layout: &Layout) -> Result<(), SetupError> {
        for (i, node) in self.nodes.iter().enumerate() {
            let listed = format!("nodes[{i}].name");
            let n = node.ends.len();
            if n == 0 {
                return Err(fault(&listed, format!("no segment starts or ends at `{}`", node.name)));
            }
            if node.kind != NodeKind::Junction && n > 1 {
                let message =
                    format!("{n} segments meet at `{}`: an inlet or an outlet is the end of one", node.name);
                return Err(fault(&listed, message));
            }
            if node.kind == NodeKind::Junction && n == 1 {
                let at = layout.segments.iter().position(|s| s.from == node.name || s.to == node.name);
                let message = format!(
                    "nothing follows `{}`: list it in `nodes` as an inlet or an outlet (\"rcr\", \"resistance\"), or join \
                     another segment to it",
                    node.name
                );
                return Err(fault(&format!("segments[{}]", at.unwrap_or_default()), message));
            }
        }
        Ok(())
    }

    /// Refuses tubes that no way joins to the first inlet.
    fn check_connected(&self, layout: &Layout) -> Result<(), SetupError> {
        let mut reached = vec![false; self.nodes.len()];
        let mut next = vec![self.inlets[0]];
        while let Some(node) = next.pop() {
            if !std::mem::replace(&mut reached[node], true) {
                next.extend(self.nodes[node].ends.iter().flat_map(|end| self.tubes[end.tube].nodes));
                next.extend(self.nodes[node].narrowing.iter().flat_map(|(i, _)| self.narrowings[*i].nodes));
            }
        }
        let lost = |s: &Segment| self.nodes.iter().zip(&reached).any(|(n, r)| n.name == s.from && !r);
        match layout.segments.iter().position(lost) {
            None => Ok(()),
            Some(i) => {
                let message = format!(
                    "no way leads from the inlet `{}` to `{}`: join it to the network",
                    self.nodes[self.inlets[0]].name, layout.segments[i].name
                );
                Err(fault(&format!("segments[{i}]"), message))
            }
        }
    }
}
