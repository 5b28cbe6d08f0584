//! Where an effect can enter a model: scalar quantities by role, alone or in pairs, and the names that belong to a place.
//!
//! A name has a suffix only where a model has several places of a kind. Next file to read: [`super::draft`].

use crate::effect::def::OUTPUT;
use crate::equations::check::usable;
use crate::{Quantity, Role, Spec};

/// A model that effects look for a place in.
#[derive(Clone, Copy)]
pub(super) struct Host<'a> {
    /// What the model says of itself.
    pub(super) spec: &'a Spec,
    /// Label of the time unit.
    pub(super) time: &'a str,
}

/// One place where an effect enters, with the names that belong to it.
#[derive(Clone)]
pub(super) struct EffectPlace<'a> {
    host: Host<'a>,
    /// Names of the quantities that tell this place from others of its kind; empty where there is only one.
    told_by: Vec<&'a str>,
}

impl EffectPlace<'_> {
    /// Name of an effect at this place: `drag`, or `drag:v2`.
    pub(super) fn effect(&self, stem: &str) -> String {
        self.told_by.iter().fold(stem.to_owned(), |name, quantity| format!("{name}:{quantity}"))
    }

    /// Name of an effect's parameter or state at this place, `c` or `c_v2`, that the model does not have itself.
    pub(super) fn name(&self, stem: &str) -> String {
        let mut name =
            self.told_by.iter().fold(stem.to_owned(), |name, quantity| format!("{name}_{quantity}"));
        while self.host.has(&name) {
            name.push('_');
        }
        name
    }

    /// How a term says that it adds to this output.
    pub(super) fn output(&self, output: &Quantity) -> String {
        let state = self.host.spec.states.iter().any(|q| q.name == output.name);
        if state { format!("{OUTPUT}{}", output.name) } else { output.name.clone() }
    }
}

impl<'a> Host<'a> {
    /// Whether the model has a quantity of this name.
    fn has(self, name: &str) -> bool {
        let spec = self.spec;
        let lists = [&spec.states, &spec.parameters, &spec.inputs, &spec.outputs];
        lists.into_iter().flatten().any(|q| q.name == name)
    }

    /// Scalar states of a role.
    pub(super) fn states(self, role: Role) -> Vec<&'a Quantity> {
        scalars(&self.spec.states, Some(role))
    }

    /// Scalar outputs of a role.
    pub(super) fn outputs(self, role: Role) -> Vec<&'a Quantity> {
        scalars(&self.spec.outputs, Some(role))
    }

    /// Scalar inputs of a role.
    pub(super) fn inputs(self, role: Role) -> Vec<&'a Quantity> {
        scalars(&self.spec.inputs, Some(role))
    }

    /// Parameters of a role.
    pub(super) fn parameters(self, role: Role) -> Vec<&'a Quantity> {
        scalars(&self.spec.parameters, Some(role))
    }

    /// Every scalar state.
    pub(super) fn all_states(self) -> Vec<&'a Quantity> {
        scalars(&self.spec.states, None)
    }

    /// Every scalar output.
    pub(super) fn all_outputs(self) -> Vec<&'a Quantity> {
        scalars(&self.spec.outputs, None)
    }

    /// Every scalar input.
    pub(super) fn all_inputs(self) -> Vec<&'a Quantity> {
        scalars(&self.spec.inputs, None)
    }

    /// One place for each of these quantities.
    pub(super) fn each(self, list: Vec<&'a Quantity>) -> Vec<(EffectPlace<'a>, &'a Quantity)> {
        let several = list.len() > 1;
        let place = |q: &'a Quantity| EffectPlace { host: self, told_by: told(several, &[q]) };
        list.into_iter().map(|q| (place(q), q)).collect()
    }

    /// One place for every pair of different quantities, one of each list.
    pub(super) fn pairs(
        self,
        first: &[&'a Quantity],
        second: &[&'a Quantity],
    ) -> Vec<(EffectPlace<'a>, &'a Quantity, &'a Quantity)> {
        let all = first.iter().flat_map(|a| second.iter().map(move |b| (*a, *b)));
        let pairs: Vec<_> = all.filter(|(a, b)| a.name != b.name).collect();
        let several = pairs.len() > 1;
        let place = |a, b| EffectPlace { host: self, told_by: told(several, &[a, b]) };
        pairs.into_iter().map(|(a, b)| (place(a, b), a, b)).collect()
    }

    /// One place for each quantity of the first list, with those of the second in the same order when both have as many;
    /// else every pair.
    pub(super) fn matched(
        self,
        first: &[&'a Quantity],
        second: &[&'a Quantity],
    ) -> Vec<(EffectPlace<'a>, &'a Quantity, &'a Quantity)> {
        if first.len() != second.len() {
            return self.pairs(first, second);
        }
        let each = self.each(first.to_vec());
        each.into_iter().zip(second).map(|((place, a), b)| (place, a, *b)).collect()
    }
}

fn told<'a>(several: bool, by: &[&'a Quantity]) -> Vec<&'a str> {
    if several { by.iter().map(|q| q.name.as_str()).collect() } else { Vec::new() }
}

/// Scalar quantities of a role, or of any, whose names can stand in a term.
fn scalars(list: &[Quantity], role: Option<Role>) -> Vec<&Quantity> {
    list.iter()
        .filter(|q| q.size == 1 && role.is_none_or(|role| q.role == role) && usable(&q.name, "it").is_ok())
        .collect()
}
