//! The layout of an arterial network as a study writes it: vessels between named nodes.
//!
//! Only the text is here; whether the vessels make a network is checked in [`super::network`], the next file to read.

use serde::Deserialize;

/// Vessels and their ends; without one, a straight tube of five regions between an inlet and an RCR outlet.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// The vessels, in the order in which their cells stand in states and outputs.
    pub segments: Vec<Segment>,
    /// The inlets, the outlets and the stenoses; a node where vessels join need not be listed.
    pub nodes: Vec<NodeEntry>,
}

/// One vessel.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Name: letters, digits and `_`.
    pub name: String,
    /// Node at which x = 0; flow is counted positive from here on.
    pub from: String,
    /// Node at which x is the length.
    pub to: String,
    /// Length in cm.
    pub length: f64,
    /// Inner radius without load, R0, in cm.
    pub radius: f64,
    /// R0 at `to` in cm, for a vessel that tapers; by default as at `from`.
    pub radius_to: Option<f64>,
    /// Wall thickness h in cm, at `from`.
    pub thickness: f64,
    /// h at `to` in cm, linear in between; by default as at `from`.
    pub thickness_to: Option<f64>,
    /// E h/R0 as a function of R0, where it is given so; `thickness` then sets the stress alone.
    pub wall: Option<WallLaw>,
    /// ζ of the velocity profile u (ζ + 2)/ζ (1 − (r/R)^ζ), which the friction 2(ζ + 2)πμ Q/A follows from (Smith, Pullan &
    /// Hunter 2002): 2 for a parabola, more for a flatter one.
    #[serde(default = "parabola")]
    pub profile: f64,
    /// What resists the flow.
    #[serde(default)]
    pub friction: Friction,
    /// Number of cells.
    #[serde(default = "twenty")]
    pub cells: usize,
    /// Number of equally long regions, each with a stiffness of its own.
    #[serde(default = "one")]
    pub regions: usize,
}

/// Shear stress of the blood at the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Friction {
    /// As in a steady flow with the profile of the segment.
    #[default]
    Steady,
    /// As in an unsteady laminar flow (Womersley 1955; Zielke 1968): the wall shear remembers past accelerations.
    Womersley,
}

/// The stiffness of arteries by their size, E h/R0 = k1 e^(k2 R0) + k3 (Olufsen 1999).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallLaw {
    /// In dyn/cm².
    pub k1: f64,
    /// In 1/cm.
    pub k2: f64,
    /// In dyn/cm².
    pub k3: f64,
}

impl WallLaw {
    /// E h/R0 in dyn/cm² at a radius R0 in cm.
    pub(super) fn at(self, radius: f64) -> f64 {
        self.k3 + self.k1 * (self.k2 * radius).exp()
    }
}

/// A node at which something other than joining happens.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeEntry {
    /// Name, as vessels use it.
    pub name: String,
    /// What happens there.
    pub kind: NodeKind,
    /// Length in cm, which a stenosis needs and no other node has.
    pub length: Option<f64>,
}

/// What happens at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NodeKind {
    /// An input flow enters.
    Inlet,
    /// Vessels join: mass is conserved, total pressure continuous.
    Junction,
    /// Blood leaves through a three-element Windkessel.
    Rcr,
    /// Blood leaves through a resistance.
    Resistance,
    /// Two vessels join through a narrowing that takes pressure.
    Stenosis,
}

fn twenty() -> usize {
    20
}

fn parabola() -> f64 {
    2.0
}

fn one() -> usize {
    1
}

impl Default for Layout {
    fn default() -> Self {
        let tube = Segment {
            name: "tube".to_owned(),
            from: "inlet".to_owned(),
            to: "outlet".to_owned(),
            length: 25.0,
            radius: 1.0,
            radius_to: None,
            thickness: 0.15,
            thickness_to: None,
            wall: None,
            profile: parabola(),
            friction: Friction::Steady,
            cells: 20,
            regions: 5,
        };
        let node = |name: &str, kind| NodeEntry { name: name.to_owned(), kind, length: None };
        Self {
            segments: vec![tube],
            nodes: vec![node("inlet", NodeKind::Inlet), node("outlet", NodeKind::Rcr)],
        }
    }
}

/// The parameter that sets the stiffness of one region.
#[derive(Debug)]
pub(super) struct StiffnessParameter {
    pub(super) name: String,
    /// Whose it is.
    pub(super) place: String,
    /// Whether it is a multiple of what a law says, and no Young's modulus.
    pub(super) of_law: bool,
}

/// That of a region of a segment, which may be the only one.
pub(super) fn stiffness_parameter(segment: &Segment, region: usize, alone: bool) -> StiffnessParameter {
    let (name, number, of_law) = (&segment.name, region + 1, segment.wall.is_some());
    let stem = if of_law { "stiffness" } else { "E" };
    let (name, place) = match (alone, segment.regions) {
        (true, _) => (format!("{stem}{number}"), format!("region {number} of `{name}`")),
        (false, 1) => (format!("{stem}_{name}"), format!("`{name}`")),
        (false, _) => (format!("{stem}_{name}_{number}"), format!("region {number} of `{name}`")),
    };
    StiffnessParameter { name, place, of_law }
}
