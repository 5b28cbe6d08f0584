//! What a model says of itself: its states, parameters, outputs and inputs, with units, ranges and physical roles.
//!
//! This file holds no behaviour. Next file to read: [`crate::model`].

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// The physical meaning of a quantity; observers and effects find their place in a model by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// A displacement of a structure.
    Displacement,
    /// A velocity of a structure.
    Velocity,
    /// A liquid level.
    Level,
    /// A pressure.
    Pressure,
    /// A volume flow.
    Flow,
    /// A temperature.
    Temperature,
    /// A force.
    Force,
    /// A resistance to flow.
    Resistance,
    /// A compliance.
    Compliance,
    /// An inertance or a mass.
    Inertia,
    /// A stiffness.
    Stiffness,
    /// A damping coefficient.
    Damping,
    /// A shift in time by which an input is read earlier or later than now.
    Shift,
    /// The area of a nozzle's throat.
    ThroatArea,
    /// A coefficient to which the burning rate of a propellant is proportional.
    BurnRate,
    /// A factor or coefficient to which the burning surface of a propellant is proportional.
    BurnArea,
    /// The distance burnt into a propellant.
    Web,
    /// The thrust of a nozzle.
    Thrust,
    /// Anything else.
    #[default]
    Other,
}

/// One named quantity of a model: a state, a parameter, an output or an input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Name, unique among the model's quantities of its kind.
    pub name: String,
    /// Unit label; empty when dimensionless or unknown.
    pub unit: String,
    /// Number of components: 1 for a scalar, n for a field.
    pub size: usize,
    /// Smallest and largest value that physics allows; infinite where it sets no bound.
    #[serde(with = "crate::bounds")]
    pub range: [f64; 2],
    /// Physical meaning.
    pub role: Role,
    /// Value used when neither the study's constants nor its parameters give one.
    pub default: Option<f64>,
    /// One plain sentence.
    pub says: String,
}

impl Quantity {
    /// A scalar quantity without bounds, default or role.
    pub fn new(name: &str, unit: &str) -> Self {
        Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            size: 1,
            range: [f64::NEG_INFINITY, f64::INFINITY],
            role: Role::Other,
            default: None,
            says: String::new(),
        }
    }

    /// The same quantity as a field of `n` components.
    #[must_use]
    pub fn size(mut self, n: usize) -> Self {
        self.size = n;
        self
    }

    /// The same quantity with a physical meaning.
    #[must_use]
    pub fn role(mut self, role: Role) -> Self {
        self.role = role;
        self
    }

    /// The same quantity restricted to `[lo, hi]`.
    #[must_use]
    pub fn range(mut self, lo: f64, hi: f64) -> Self {
        self.range = [lo, hi];
        self
    }

    /// The same quantity restricted to values above zero.
    #[must_use]
    pub fn positive(self) -> Self {
        self.range(f64::MIN_POSITIVE, f64::INFINITY)
    }

    /// The range in words of a table: `> 0`, `>= 1`, `<= 2`, `1 to 2`, or `any`.
    pub fn range_text(&self) -> String {
        match self.range {
            [lo, hi] if lo.is_infinite() && hi.is_infinite() => "any".to_owned(),
            [lo, hi] if lo > 0.0 && lo <= f64::MIN_POSITIVE && hi.is_infinite() => "> 0".to_owned(),
            [lo, hi] if hi.is_infinite() => format!(">= {lo}"),
            [lo, hi] if lo.is_infinite() => format!("<= {hi}"),
            [lo, hi] => format!("{lo} to {hi}"),
        }
    }

    /// The same quantity with a default value.
    #[must_use]
    pub fn default(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// The same quantity with one sentence about it.
    #[must_use]
    pub fn says(mut self, sentence: &str) -> Self {
        sentence.clone_into(&mut self.says);
        self
    }
}

/// What a model says of itself. Vectors of states and outputs are the concatenation of the quantities in this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spec {
    /// The `kind` by which a study names the model.
    pub kind: String,
    /// One plain sentence.
    pub says: String,
    /// State quantities.
    pub states: Vec<Quantity>,
    /// Parameters.
    pub parameters: Vec<Quantity>,
    /// Outputs that can be observed.
    pub outputs: Vec<Quantity>,
    /// Input signals that the model needs.
    pub inputs: Vec<Quantity>,
    /// For each output that measures one state (up to terms without state), the pair (output name, state name).
    pub measures: Vec<(String, String)>,
    /// Whether a run can start from a given state.
    pub restart: bool,
}

impl Spec {
    /// Number of state components.
    pub fn n_state(&self) -> usize {
        self.states.iter().map(|q| q.size).sum()
    }

    /// Number of output components.
    pub fn n_output(&self) -> usize {
        self.outputs.iter().map(|q| q.size).sum()
    }

    /// Position of the named quantity's first component in the concatenation of `list`.
    pub fn offset(list: &[Quantity], name: &str) -> Option<usize> {
        let mut at = 0;
        for q in list {
            if q.name == name {
                return Some(at);
            }
            at += q.size;
        }
        None
    }

    /// Positions in the concatenation of `list` that a name stands for: all components of `wall`, or one, `wall[2]`.
    pub fn range_of(list: &[Quantity], name: &str) -> Option<Range<usize>> {
        let whole = |name: &str| {
            let size = list.iter().find(|q| q.name == name).map(|q| q.size);
            Self::offset(list, name).zip(size).map(|(first, size)| first..first + size)
        };
        whole(name).or_else(|| {
            let (field, index) = name.strip_suffix(']')?.rsplit_once('[')?;
            let field = whole(field)?;
            let at = field.start + index.parse::<usize>().ok()?;
            (at < field.end).then_some(at..at + 1)
        })
    }

    /// Position of a scalar state, or of one component of a field of states: what a run can record under that name.
    pub(crate) fn scalar_state(&self, name: &str) -> Option<usize> {
        Self::range_of(&self.states, name).filter(|range| range.len() == 1).map(|range| range.start)
    }

    /// Name of component `at` of the concatenation of `list`, with its index in a field; empty beyond the end.
    pub fn component(list: &[Quantity], mut at: usize) -> String {
        for q in list {
            if at < q.size {
                return if q.size == 1 { q.name.clone() } else { format!("{}[{at}]", q.name) };
            }
            at -= q.size;
        }
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantity_survives_json_with_its_open_range() {
        let quantity = Quantity::new("R", "mmHg s/mL").positive().role(Role::Resistance).default(1.5);
        let text = serde_json::to_string(&quantity).unwrap();
        assert_eq!(serde_json::from_str::<Quantity>(&text).unwrap(), quantity, "{text}");
    }

    #[test]
    fn a_range_reads_as_a_table_entry() {
        let text = |lo, hi| Quantity::new("a", "").range(lo, hi).range_text();
        assert_eq!(Quantity::new("a", "").positive().range_text(), "> 0");
        assert_eq!(text(0.0, f64::INFINITY), ">= 0");
        assert_eq!(text(-1.0, 2.5), "-1 to 2.5");
        assert_eq!(text(f64::NEG_INFINITY, f64::INFINITY), "any");
    }
}
