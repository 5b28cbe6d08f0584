//! What a solver says of itself, both ways.

use std::collections::HashSet;

use starlings_models::{Description, Quantity, Role, SOLVER, Spec};

use super::{SOLVER_PROTOCOL, WireError};
use crate::solver_wire as wire;

/// The message of a description.
pub fn encode_description(description: &Description) -> wire::Description {
    let Description { spec, name, deterministic, observers, hosts } = description;
    let list = |quantities: &[Quantity]| quantities.iter().map(encode_quantity).collect();
    let measure =
        |(output, state): &(String, String)| wire::Measure { output: output.clone(), state: state.clone() };
    wire::Description {
        protocol: SOLVER_PROTOCOL,
        name: name.clone(),
        says: spec.says.clone(),
        states: list(&spec.states),
        parameters: list(&spec.parameters),
        outputs: list(&spec.outputs),
        inputs: list(&spec.inputs),
        restart: spec.restart,
        deterministic: *deterministic,
        observers: observers.clone(),
        hosts: hosts.clone(),
        measures: spec.measures.iter().map(measure).collect(),
    }
}

/// What a solver says of itself.
///
/// # Errors
/// When it speaks another protocol, gives two quantities one name, or names something that it does not have.
pub fn decode_description(message: &wire::Description) -> Result<Description, WireError> {
    if message.protocol != SOLVER_PROTOCOL {
        return Err(wrong(format!(
            "it speaks protocol {}, this worker speaks {SOLVER_PROTOCOL}: use matching versions of both",
            message.protocol
        )));
    }
    let spec = Spec {
        kind: SOLVER.to_owned(),
        says: message.says.clone(),
        states: list("state", &message.states)?,
        parameters: list("parameter", &message.parameters)?,
        outputs: list("output", &message.outputs)?,
        inputs: list("input", &message.inputs)?,
        measures: message.measures.iter().map(|m| (m.output.clone(), m.state.clone())).collect(),
        restart: message.restart,
    };
    let scalars = [("parameter", &spec.parameters), ("input", &spec.inputs)];
    for (what, quantities) in scalars {
        if let Some(field) = quantities.iter().find(|q| q.size != 1) {
            return Err(wrong(format!(
                "{what} `{}` has {} components; it must be a scalar",
                field.name, field.size
            )));
        }
    }
    if spec.outputs.is_empty() {
        return Err(wrong("it has no outputs, so nothing could be compared with data".to_owned()));
    }
    if spec.restart && spec.states.is_empty() {
        return Err(wrong("it can restart from a state but describes no states".to_owned()));
    }
    let known = |state: &String| Spec::range_of(&spec.states, state).is_some();
    let measured = spec.measures.iter().map(|(_, state)| state);
    if let Some(state) = message.hosts.iter().chain(measured).find(|state| !known(state)) {
        return Err(wrong(format!("it names the state `{state}`, which is not among its states")));
    }
    Ok(Description {
        spec,
        name: if message.name.is_empty() { "solver".to_owned() } else { message.name.clone() },
        deterministic: message.deterministic,
        observers: message.observers.clone(),
        hosts: message.hosts.clone(),
    })
}

fn encode_quantity(q: &Quantity) -> wire::Quantity {
    let role = serde_json::to_value(q.role).ok().and_then(|value| value.as_str().map(str::to_owned));
    let bound = |value: f64| value.is_finite().then_some(value);
    wire::Quantity {
        name: q.name.clone(),
        unit: q.unit.clone(),
        size: q.size as u32,
        role: role.unwrap_or_default(),
        lo: bound(q.range[0]),
        hi: bound(q.range[1]),
        default_value: q.default,
        says: q.says.clone(),
    }
}

fn list(what: &str, quantities: &[wire::Quantity]) -> Result<Vec<Quantity>, WireError> {
    let mut names = HashSet::new();
    let one = |q: &wire::Quantity| {
        if q.name.is_empty() || q.name.contains([':', '[', ']']) {
            return Err(wrong(format!("`{}` is no name for a {what}", q.name)));
        }
        if !names.insert(q.name.clone()) {
            return Err(wrong(format!("it describes the {what} `{}` twice", q.name)));
        }
        let role = if q.role.is_empty() { "other" } else { &q.role };
        let role: Role = serde_json::from_value(role.into())
            .map_err(|_| wrong(format!("{what} `{}` has the role `{role}`, which does not exist", q.name)))?;
        let range = [q.lo.unwrap_or(f64::NEG_INFINITY), q.hi.unwrap_or(f64::INFINITY)];
        if range[0] > range[1] || range.iter().any(|bound| bound.is_nan()) {
            return Err(wrong(format!("{what} `{}` has the range {} to {}", q.name, range[0], range[1])));
        }
        Ok(Quantity {
            range,
            default: q.default_value,
            ..Quantity::new(&q.name, &q.unit).size(q.size.max(1) as usize).role(role).says(&q.says)
        })
    };
    quantities.iter().map(one).collect()
}

fn wrong(message: String) -> WireError {
    WireError::Shape { field: "description", message }
}
