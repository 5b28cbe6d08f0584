//! The parameters of a network: one per value, or one for all values that share a name.
//!
//! A number in the netlist is the default of the value's own parameter, so every value can be estimated. Next file to
//! read: [`super::assembly`].

use starlings_models_core::layout::fault;
use starlings_models_core::{Quantity, SetupError};

use super::netlist::Value;
use super::units::{Measure, System};

/// The parameters so far.
pub(super) struct Parameters {
    system: System,
    list: Vec<(Measure, Quantity)>,
}

/// One value of an element.
pub(super) struct Slot<'a> {
    /// Where it is written, such as `elements[2].value`.
    pub(super) path: &'a str,
    /// Name of its own parameter.
    pub(super) name: String,
    pub(super) measure: Measure,
    /// One plain sentence, should it become a parameter of its own.
    pub(super) says: String,
    /// Default of its own parameter when the netlist gives no number.
    pub(super) default: Option<f64>,
}

impl Parameters {
    pub(super) fn new(system: System) -> Self {
        Self { system, list: Vec::new() }
    }

    /// The quantities, in the order of the model's θ.
    pub(super) fn into_quantities(self) -> Vec<Quantity> {
        self.list.into_iter().map(|(_, quantity)| quantity).collect()
    }

    /// Position in θ of a value.
    pub(super) fn place(&mut self, slot: Slot<'_>, value: Option<&Value>) -> Result<usize, SetupError> {
        let (name, says, default) = match value {
            Some(Value::Name(shared)) => {
                if !identifier(shared) {
                    let message = format!("`{shared}` is no name of a parameter: letters, digits and `_`");
                    return Err(fault(slot.path, message));
                }
                (shared.clone(), format!("A {} that elements share.", slot.measure.word()), None)
            }
            Some(Value::Number(number)) => (slot.name, slot.says, Some(*number)),
            None => (slot.name, slot.says, slot.default),
        };
        let [lo, hi] = slot.measure.range();
        if let Some(number) = default.filter(|number| !(lo..=hi).contains(number) || !number.is_finite()) {
            // A resistance of zero is an open connection; a store of zero is a state too many.
            let remedy = if number == 0.0 { ": leave the element out" } else { "" };
            let message = format!("`{name}`: no {} has the value {number}{remedy}", slot.measure.word());
            return Err(fault(slot.path, message));
        }
        if let Some(at) = self.list.iter().position(|(_, q)| q.name == name) {
            let (measure, known) = &mut self.list[at];
            if *measure != slot.measure {
                let (one, other) = (measure.word(), slot.measure.word());
                let message =
                    format!("`{name}` cannot be a {one} and a {other}: give one of the two another name");
                return Err(fault(slot.path, message));
            }
            known.default = known.default.or(default);
            return Ok(at);
        }
        let mut quantity = Quantity::new(&name, slot.measure.label(self.system))
            .role(slot.measure.role())
            .range(lo, hi)
            .says(&says);
        quantity.default = default;
        self.list.push((slot.measure, quantity));
        Ok(self.list.len() - 1)
    }
}

/// Whether a text can be part of a name.
pub(super) fn identifier(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
