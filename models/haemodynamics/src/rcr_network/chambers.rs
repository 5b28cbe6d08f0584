//! Chambers of a heart, and compliances that they press on.
//!
//! Next file to read: [`super::laws`] for the pressure of a chamber.

use starlings_models_core::layout::fault;
use starlings_models_core::{Quantity, SetupError};

use super::assembly::Assembly;
use super::circuit::{Around, Chamber, Ends, FlowOf, Tie, TieKind};
use super::netlist::{Element, Value};
use super::units::Measure;

impl Assembly {
    /// A chamber between its node and the ground, or the node outside of it; its state is its volume.
    pub(super) fn heart_chamber(
        &mut self,
        element: &Element,
        ends: Ends,
        path: &str,
    ) -> Result<FlowOf, SetupError> {
        let name = element.name.as_str();
        let zero = Value::Number(0.0);
        let active =
            self.value(element, path, Measure::Elastance, ("active", "Emax", element.active.as_ref()))?;
        let passive = element.passive.as_ref().unwrap_or(&zero);
        contracts(element, path)?;
        let passive = self.value(element, path, Measure::Elastance, ("passive", "Emin", Some(passive)))?;
        let rest = element.rest.as_ref().unwrap_or(&zero);
        let rest = self.value(element, path, Measure::Volume, ("rest", "V0", Some(rest)))?;
        let rest_active = match &element.rest_active {
            Some(value) => self.value(element, path, Measure::Volume, ("rest_active", "V0s", Some(value)))?,
            None => rest,
        };
        let wall = match (&element.wall, &element.stiffening) {
            (None, None) => None,
            (Some(wall), Some(rate)) => Some([
                self.value(element, path, Measure::Pressure, ("wall", "Kp", Some(wall)))?,
                self.value(element, path, Measure::Stiffening, ("stiffening", "Kv", Some(rate)))?,
            ]),
            _ => {
                let message = format!("the passive wall of `{name}` has `wall` and `stiffening`, or neither");
                return Err(fault(path, message));
            }
        };
        let input = element.input.as_ref().unwrap_or(&element.name);
        let activation = self.signal(input, Measure::Activation, None, &format!("{path}.input"))?;
        let beside = self.circuit.ties.iter().find(|tie| {
            let [a, b] = [tie.ends.from, tie.ends.to];
            [a, b] == [ends.from, ends.to] || [b, a] == [ends.from, ends.to]
        });
        if let Some(beside) = beside {
            let message = format!(
                "`{name}` and `{}` both fix the pressure between their nodes: put a resistance between the two",
                beside.says
            );
            return Err(fault(path, message));
        }
        let (output, state) = (format!("V_{name}"), format!("stored_V_{name}"));
        let initial = element.initial.unwrap_or(match element.rest {
            Some(Value::Number(rest)) => rest,
            _ => 0.0,
        });
        let quantity = Quantity::new(&state, Measure::Volume.label(self.units)).role(Measure::Volume.role());
        let state_at = self.state(quantity.says(&format!("Volume of `{name}`.")), initial);
        self.volumes.push((name.to_owned(), state_at));
        self.measures.push((output, state));
        let law = Chamber { active, passive, rest, rest_active, wall, activation };
        let kind = TieKind::Chamber { state: state_at, law };
        self.circuit.ties.push(Tie { ends, kind, says: name.to_owned(), path: path.to_owned() });
        Ok(FlowOf::Tie(self.circuit.ties.len() - 1))
    }

    /// A compliance under a share of a chamber's pressure; its state is the pressure drop above that.
    pub(super) fn compliance_under(
        &mut self,
        element: &Element,
        ends: Ends,
        compliance: usize,
        path: &str,
    ) -> Result<FlowOf, SetupError> {
        let name = element.name.as_str();
        if element.input.is_some() {
            let message =
                format!("`{name}` is under a chamber (`around`) or an `input`: remove one of the two");
            return Err(fault(path, message));
        }
        let one = Value::Number(1.0);
        let share = element.share.as_ref().unwrap_or(&one);
        let share = self.value(element, path, Measure::Share, ("share", "share", Some(share)))?;
        let node = self.node(element.around.as_ref(), &format!("{path}.around"))?;
        let quantity = Quantity::new(&format!("stored_v_{name}"), Measure::Pressure.label(self.units))
            .role(Measure::Pressure.role())
            .says(&format!("Pressure across the wall of `{name}`."));
        let state = self.state(quantity, element.initial.unwrap_or(0.0));
        let kind = TieKind::Under { state, compliance, share, around: Around { node, tie: usize::MAX } };
        self.circuit.ties.push(Tie { ends, kind, says: name.to_owned(), path: path.to_owned() });
        Ok(FlowOf::Tie(self.circuit.ties.len() - 1))
    }
}

/// That a chamber is stiffer active than at rest, as far as the values are numbers.
fn contracts(element: &Element, path: &str) -> Result<(), SetupError> {
    match (&element.active, &element.passive) {
        (Some(Value::Number(active)), Some(Value::Number(passive))) if active < passive => {
            let message = format!(
                "`{}` is softer active than at rest, elastance {active} below {passive}, and would fill as it contracts: are the two \
                 exchanged?",
                element.name
            );
            Err(fault(&format!("{path}.active"), message))
        }
        _ => Ok(()),
    }
}
