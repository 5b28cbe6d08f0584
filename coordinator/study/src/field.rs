//! Fields and their components: `wall` has n components, `wall[2]` is one of them, counted from 0.
//!
//! Next file to read: `record/channel.rs`, which takes a field apart into channels.

use starlings_models::{Quantity, Spec};

/// The field and the index of a component's name; nothing for any other name.
pub fn component_of(name: &str) -> Option<(&str, usize)> {
    let (field, index) = name.strip_suffix(']')?.rsplit_once('[')?;
    Some((field, index.parse().ok()?))
}

/// The name of the field that a component belongs to, or else the name itself.
pub fn field_of(name: &str) -> &str {
    component_of(name).map_or(name, |(field, _)| field)
}

/// The quantity that a name stands for, as a whole or as one of its components.
pub fn quantity_of<'a>(list: &'a [Quantity], name: &str) -> Option<&'a Quantity> {
    let exact = list.iter().find(|q| q.name == name);
    exact.or_else(|| {
        Spec::range_of(list, name)?;
        list.iter().find(|q| q.name == field_of(name))
    })
}

/// Unit label of an output or a state; empty for any other name.
pub(crate) fn unit_of(spec: &Spec, name: &str) -> String {
    let found = quantity_of(&spec.outputs, name).or_else(|| quantity_of(&spec.states, name));
    found.map(|q| q.unit.clone()).unwrap_or_default()
}

/// The names of all components of these quantities, in the order of their concatenation.
pub fn components(list: &[Quantity]) -> Vec<String> {
    let n = list.iter().map(|q| q.size).sum();
    (0..n).map(|at| Spec::component(list, at)).collect()
}

/// Outputs as a reader names them: components of a field as one, with their number.
pub fn observed_fields(outputs: &[String]) -> Vec<String> {
    let mut fields: Vec<(&str, usize)> = Vec::new();
    for output in outputs {
        let (field, n) = component_of(output).map_or((output.as_str(), 0), |(field, _)| (field, 1));
        match fields.iter_mut().find(|(known, _)| *known == field) {
            Some((_, count)) => *count += n,
            None => fields.push((field, n)),
        }
    }
    let text = |(field, n): (&str, usize)| {
        if n == 0 { field.to_owned() } else { format!("{field} ({n} components)") }
    };
    fields.into_iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_is_known_by_its_field_and_index() {
        let list = [Quantity::new("p", "mmHg"), Quantity::new("wall", "cm").size(3)];
        let unit = |name: &str| quantity_of(&list, name).map(|q| q.unit.as_str());
        assert_eq!(
            ["p", "wall", "wall[2]", "wall[3]", "p[1]"].map(unit),
            [Some("mmHg"), Some("cm"), Some("cm"), None, None]
        );
        assert_eq!(components(&list), ["p", "wall[0]", "wall[1]", "wall[2]"]);
        let observed = ["p", "wall[0]", "wall[2]"].map(str::to_owned);
        assert_eq!(observed_fields(&observed), ["p", "wall (2 components)"]);
        assert_eq!((field_of("wall[2]"), field_of("R[in-vivo-1]")), ("wall", "R[in-vivo-1]"));
    }
}
