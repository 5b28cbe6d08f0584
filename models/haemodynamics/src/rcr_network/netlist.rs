//! The netlist as it is written in a study: nodes and elements.
//!
//! It says what is connected to what, and gives every value a name or a number; it solves nothing. Next file to read:
//! [`super::assembly`], which turns it into a circuit.

use serde::{Deserialize, Deserializer};

use super::units::System;

/// The node at zero pressure, which needs no declaration.
pub(super) const GROUND: &str = "0";

/// A network of elements between nodes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Netlist {
    /// Which labels the quantities carry.
    #[serde(default)]
    pub(super) units: System,
    /// The nodes; where the list is empty, those that the elements name.
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    pub(super) elements: Vec<Element>,
    /// Pressure differences that are outputs.
    #[serde(default)]
    pub(super) gauges: Vec<Gauge>,
    /// Relative tolerance of the integration of a network that is not linear.
    #[serde(default = "tolerance")]
    pub(super) tolerance: f64,
}

fn tolerance() -> f64 {
    1e-6
}

/// An output p(from) − p(to).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Gauge {
    pub(super) name: String,
    pub(super) from: String,
    pub(super) to: String,
}

/// A point of the network with one pressure.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Node {
    pub(super) name: String,
    /// Pressure at the start, where the node stores volume.
    pub(super) initial: Option<f64>,
}

/// One element, its flow counted from `from` to `to`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) from: Option<String>,
    pub(super) to: Option<String>,
    /// R, C, L: the value. Pressure: a constant pressure.
    pub(super) value: Option<Value>,
    /// RCR: resistance before the chamber.
    pub(super) proximal: Option<Value>,
    /// RCR: compliance of the chamber.
    pub(super) compliance: Option<Value>,
    /// RCR: resistance behind the chamber.
    pub(super) distal: Option<Value>,
    /// RCR: pressure behind the distal resistance.
    pub(super) venous: Option<Value>,
    /// Loss: pressure drop per flow.
    pub(super) linear: Option<Value>,
    /// Loss: pressure drop per flow squared.
    pub(super) quadratic: Option<Value>,
    /// Diode: resistance when open.
    pub(super) open: Option<Value>,
    /// Diode: resistance when closed.
    pub(super) closed: Option<Value>,
    /// Diode: pressure drop over which it opens; without it, at once.
    pub(super) smooth: Option<f64>,
    /// Diode: how steeply the resistance goes from closed to open, per pressure.
    pub(super) steepness: Option<f64>,
    /// C: a node with a chamber, a share of whose pressure is outside.
    pub(super) around: Option<String>,
    /// C: the share.
    pub(super) share: Option<Value>,
    /// Chamber: elastance when fully active.
    pub(super) active: Option<Value>,
    /// Chamber: elastance when passive.
    pub(super) passive: Option<Value>,
    /// Chamber: volume without pressure when passive.
    pub(super) rest: Option<Value>,
    /// Chamber: volume without pressure when fully active; without it, the passive one.
    pub(super) rest_active: Option<Value>,
    /// Chamber: scale of the pressure of an exponential passive wall.
    pub(super) wall: Option<Value>,
    /// Chamber: rate of that exponential per volume.
    pub(super) stiffening: Option<Value>,
    /// C: input with the pressure outside. Flow, pressure: input with the source's value. Chamber: input with the activation.
    pub(super) input: Option<String>,
    /// Flow, pressure: by how much the source follows its input.
    pub(super) shift: Option<Value>,
    /// C, L, RCR, chamber: value at the start.
    pub(super) initial: Option<f64>,
}

/// What an element is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub(super) enum Kind {
    #[default]
    R,
    C,
    L,
    #[serde(rename = "diode")]
    Diode,
    #[serde(rename = "rcr")]
    Rcr,
    #[serde(rename = "loss")]
    Loss,
    #[serde(rename = "chamber")]
    Chamber,
    #[serde(rename = "flow")]
    Flow,
    #[serde(rename = "pressure")]
    Pressure,
}

impl Kind {
    /// The keys of an element of this kind besides `name`, `kind`, `from` and `to`.
    pub(super) fn keys(self) -> &'static [&'static str] {
        match self {
            Self::R => &["value"],
            Self::C => &["value", "input", "around", "share", "initial"],
            Self::L => &["value", "initial"],
            Self::Diode => &["open", "closed", "smooth", "steepness"],
            Self::Chamber => {
                &["active", "passive", "rest", "rest_active", "wall", "stiffening", "input", "initial"]
            }
            Self::Rcr => &["proximal", "compliance", "distal", "venous", "initial"],
            Self::Loss => &["linear", "quadratic"],
            Self::Flow => &["input", "shift"],
            Self::Pressure => &["value", "input", "shift"],
        }
    }

    /// How messages call it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::R => "R",
            Self::C => "C",
            Self::L => "L",
            Self::Diode => "diode",
            Self::Rcr => "rcr",
            Self::Loss => "loss",
            Self::Chamber => "chamber",
            Self::Flow => "flow",
            Self::Pressure => "pressure",
        }
    }
}

impl Element {
    /// The keys that are written, besides those that every element has.
    pub(super) fn written(&self) -> Vec<&'static str> {
        [
            ("value", self.value.is_some()),
            ("proximal", self.proximal.is_some()),
            ("compliance", self.compliance.is_some()),
            ("distal", self.distal.is_some()),
            ("venous", self.venous.is_some()),
            ("linear", self.linear.is_some()),
            ("quadratic", self.quadratic.is_some()),
            ("open", self.open.is_some()),
            ("closed", self.closed.is_some()),
            ("smooth", self.smooth.is_some()),
            ("steepness", self.steepness.is_some()),
            ("around", self.around.is_some()),
            ("share", self.share.is_some()),
            ("active", self.active.is_some()),
            ("passive", self.passive.is_some()),
            ("rest", self.rest.is_some()),
            ("rest_active", self.rest_active.is_some()),
            ("wall", self.wall.is_some()),
            ("stiffening", self.stiffening.is_some()),
            ("input", self.input.is_some()),
            ("shift", self.shift.is_some()),
            ("initial", self.initial.is_some()),
        ]
        .into_iter()
        .filter_map(|(key, written)| written.then_some(key))
        .collect()
    }
}

/// A value of an element: the default of a parameter of its own, or the name of a parameter that others may share.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Name(String),
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl serde::de::Visitor<'_> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("a number or the name of a parameter")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::Number(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::Name(value.to_owned()))
    }
}

/// An elastic aorta that feeds the upper and the lower body.
impl Default for Netlist {
    fn default() -> Self {
        let number = |value| Some(Value::Number(value));
        let node = |name: &str| Some(name.to_owned());
        let outlet = |name: &str, proximal, compliance, distal| Element {
            name: name.to_owned(),
            kind: Kind::Rcr,
            from: node("aorta"),
            proximal: number(proximal),
            compliance: number(compliance),
            distal: number(distal),
            ..Element::default()
        };
        let inflow =
            Element { name: "inflow".to_owned(), kind: Kind::Flow, to: node("aorta"), ..Element::default() };
        let wall = Element {
            name: "wall".to_owned(),
            kind: Kind::C,
            from: node("aorta"),
            value: number(0.4),
            ..Element::default()
        };
        Self {
            units: System::default(),
            nodes: Vec::new(),
            elements: vec![inflow, wall, outlet("upper", 0.2, 0.3, 3.0), outlet("lower", 0.1, 0.7, 1.5)],
            gauges: Vec::new(),
            tolerance: tolerance(),
        }
    }
}
