//! What a solver says of itself, both ways.

use starlings_models::{Description, Quantity, Role, SOLVER, Spec};

use super::{ProtocolError, SOLVER_PROTOCOL};
use crate::generated_solver as generated;

/// The message of a description.
pub fn encode_description(description: &Description) -> generated::Description {
    let Description { spec, name, deterministic, observers, hosts } = description;
    let list = |quantities: &[Quantity]| quantities.iter().map(encode_quantity).collect();
    let measure = |(output, state): &(String, String)| generated::Measure {
        output: output.clone(),
        state: state.clone(),
    };
    generated::Description {
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
/// When it speaks another protocol, or describes what makes no sense ([`Description::fault`]).
pub fn decode_description(message: &generated::Description) -> Result<Description, ProtocolError> {
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
    let name = if message.name.is_empty() { "solver" } else { &message.name };
    let description = Description {
        spec,
        name: name.to_owned(),
        deterministic: message.deterministic,
        observers: message.observers.clone(),
        hosts: message.hosts.clone(),
    };
    match description.fault() {
        Some(fault) => Err(wrong(fault)),
        None => Ok(description),
    }
}

fn encode_quantity(q: &Quantity) -> generated::Quantity {
    let role = serde_json::to_value(q.role).ok().and_then(|value| value.as_str().map(str::to_owned));
    let bound = |value: f64| value.is_finite().then_some(value);
    generated::Quantity {
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

fn list(what: &str, quantities: &[generated::Quantity]) -> Result<Vec<Quantity>, ProtocolError> {
    let one = |q: &generated::Quantity| {
        let role = if q.role.is_empty() { "other" } else { &q.role };
        let role: Role = serde_json::from_value(role.into())
            .map_err(|_| wrong(format!("{what} `{}` has the role `{role}`, which does not exist", q.name)))?;
        let range = [q.lo.unwrap_or(f64::NEG_INFINITY), q.hi.unwrap_or(f64::INFINITY)];
        Ok(Quantity {
            range,
            default: q.default_value,
            ..Quantity::new(&q.name, &q.unit).size(q.size.max(1) as usize).role(role).says(&q.says)
        })
    };
    quantities.iter().map(one).collect()
}

fn wrong(message: String) -> ProtocolError {
    ProtocolError::Shape { field: "description", message }
}
