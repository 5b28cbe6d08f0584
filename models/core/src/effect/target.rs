//! What a term adds to. Next file to read: [`super::terms`].

use super::{Addition, EffectDef};
use crate::{Quantity, Spec};

/// What a term adds to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The rate of a state.
    Rate,
    /// The value of an output.
    Output,
    /// The value of an input.
    Input,
    /// The value of a parameter.
    Parameter,
}

impl Target {
    /// What a term of an effect adds to in a model, with or without the effect's own states and parameters in `spec`; nothing
    /// where there is nothing of that name. Only the first `n_own` parameters are the model's own.
    pub fn of(add: &Addition, def: &EffectDef, spec: &Spec, n_own: usize) -> Option<Self> {
        let has = |list: &[Quantity], name: &str| list.iter().any(|q| q.name == name);
        // No state's name has a colon.
        if has(&spec.states, &add.to) || def.states.iter().any(|state| state.name == add.to) {
            Some(Self::Rate)
        } else if has(&spec.outputs, add.quantity()) {
            Some(Self::Output)
        } else if has(&spec.inputs, &add.to) {
            Some(Self::Input)
        } else {
            has(&spec.parameters[..n_own], &add.to).then_some(Self::Parameter)
        }
    }
}
