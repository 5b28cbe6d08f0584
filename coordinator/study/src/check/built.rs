//! The model of a study once it builds, and the names that a study may use for its quantities.
//!
//! Next file to read: [`super::model`], which builds it.

use starlings_models::{EffectDef, Quantity, Setup, Spec};

use crate::expand::INITIAL;
use crate::field::quantity_of;

/// A model that builds, with the effects that belong to it.
pub(crate) struct CheckedModel {
    /// Without parameters, outputs and observer.
    pub(crate) setup: Setup,
    pub(crate) spec: Spec,
    /// Effects that are described but not part of the model.
    pub(crate) candidates: Vec<EffectDef>,
    /// Names of parameters and initial values, those of the candidates included.
    pub(crate) valid_names: Vec<String>,
    pub(crate) delays: bool,
}

/// The model's description of a parameter, or of the state behind an initial value.
pub(crate) fn quantity<'a>(spec: &'a Spec, name: &str) -> Option<&'a Quantity> {
    match name.strip_prefix(INITIAL) {
        Some(state) => quantity_of(&spec.states, state),
        None => spec.parameters.iter().find(|q| q.name == name),
    }
}

/// Every name that a parameter or constant may have.
pub(crate) fn valid_names(spec: &Spec) -> Vec<String> {
    let first = |q: &Quantity| if q.size == 1 { q.name.clone() } else { format!("{}[0]", q.name) };
    let states = spec.states.iter().map(|q| format!("{INITIAL}{}", first(q)));
    spec.parameters.iter().map(|q| q.name.clone()).chain(states).collect()
}
