//! Which parameters of a model are unknown, and what is believed of them.
//!
//! Next file to read: [`super::prior`].

use starlings_models::{Quantity, Spec};

use super::Wishes;
use super::parts::{NOISE, Unknown};
use super::prior::{Prior, prior, scale};
use super::recording::Recording;
use super::roles::Roles;
use crate::files::part_of_range;

/// Unknowns at most of a model that has a default for everything.
const MOST_UNKNOWN: usize = 3;

/// Unknown parameters, and the others with their values.
type Split = (Vec<Unknown>, Vec<Quantity>);

/// Unknown and fixed parameters of a model.
pub(super) fn unknowns(
    spec: &Spec,
    constants: &[(String, f64)],
    wishes: &Wishes,
    recording: Option<&Recording>,
) -> Result<Split, String> {
    let known = |name: &str| spec.parameters.iter().any(|q| q.name == name);
    if let Some(other) = wishes.unknown.iter().find(|name| !known(name)) {
        let names: Vec<&str> = spec.parameters.iter().map(|q| q.name.as_str()).collect();
        return Err(format!("the model has no parameter `{other}` (it has: {})", names.join(", ")));
    }
    let value =
        |q: &Quantity| constants.iter().find(|(name, _)| *name == q.name).map(|(_, v)| *v).or(q.default);
    let mut wanted: Vec<&str> = wishes.unknown.iter().map(String::as_str).collect();
    wanted.extend(spec.parameters.iter().filter(|q| value(q).is_none()).map(|q| q.name.as_str()));
    if wanted.is_empty() {
        let can = spec.parameters.iter().filter(|q| value(q) != Some(0.0) && q.size == 1);
        wanted.extend(can.take(MOST_UNKNOWN).map(|q| q.name.as_str()));
    }
    if wanted.is_empty() {
        return Err("the model has no parameter that could be unknown".to_owned());
    }
    let (unknown, fixed): (Vec<&Quantity>, Vec<&Quantity>) =
        spec.parameters.iter().partition(|q| wanted.contains(&q.name.as_str()));
    let with_value = |q: &Quantity| Quantity { default: value(q), ..q.clone() };
    let of = |q: &Quantity| Unknown {
        name: q.name.clone(),
        unit: q.unit.clone(),
        says: q.says.clone(),
        prior: prior(&with_value(q), recording.and_then(|r| scale(&q.unit, r))),
    };
    Ok((unknown.into_iter().map(of).collect(), fixed.into_iter().map(with_value).collect()))
}

/// What the state was at the start, where an output that was measured shows it.
pub(super) fn initial_values(spec: &Spec, recording: &Recording, roles: &Roles) -> Vec<Unknown> {
    let measured = spec.measures.iter().filter(|_| spec.restart).filter_map(|(output, state)| {
        let (_, _, at) = roles.outputs.iter().find(|(_, name, _)| name == output)?;
        let state = spec.states.iter().find(|q| q.name == *state && q.size == 1)?;
        let column = &recording.columns[*at];
        column.values[0].is_finite().then(|| Unknown {
            name: format!("initial:{}", state.name),
            unit: state.unit.clone(),
            says: "the state at the start".to_owned(),
            prior: Prior {
                table: format!(
                    "{{ transform = \"linear\", median_from = \"{output}\", sd = {:?} }}",
                    part_of_range(&column.values, 5.0 * NOISE)
                ),
                from: "the first value that was measured",
            },
        })
    });
    measured.collect()
}
