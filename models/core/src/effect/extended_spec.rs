//! What a model with effects says of itself: the model's specification, then the effects' parameters and states.
//!
//! Names, ranges and defaults are checked and given here; terms are read by [`super::TermEffect`].

use super::{EffectDef, EffectParameter, Scale};
use crate::bounds::unbounded;
use crate::equations::check;
use crate::{Quantity, SetupError, Spec};

/// The inner model's specification with the effects' states and parameters.
pub(super) fn extended_spec(inner: &Spec, defs: &[EffectDef]) -> Result<Spec, SetupError> {
    let mut spec = inner.clone();
    for (i, def) in defs.iter().enumerate() {
        if def.name.is_empty() {
            return Err(SetupError::Invalid("an effect needs a name".to_owned()));
        }
        if defs[..i].iter().any(|d| d.name == def.name) {
            return Err(SetupError::Twice(def.name.clone()));
        }
        if def.adds.is_empty() || def.parameters.is_empty() {
            return Err(SetupError::Invalid(format!(
                "effect `{}` needs at least one term in `adds` and one parameter, its amplitude",
                def.name
            )));
        }
        for (j, parameter) in def.parameters.iter().enumerate() {
            check::usable(&parameter.name, &format!("a parameter of the effect `{}`", def.name))?;
            check::range(parameter.range, &format!("parameter `{}`", parameter.name))?;
            check_new(&spec, &parameter.name)?;
            let mut quantity = Quantity::new(&parameter.name, &parameter.unit);
            (quantity.range, quantity.default) = range_and_default(parameter, j);
            spec.parameters.push(quantity.says(&format!("Parameter of the effect `{}`.", def.name)));
        }
        for state in &def.states {
            check::usable(&state.name, &format!("a state of the effect `{}`", def.name))?;
            check_new(&spec, &state.name)?;
            let quantity = Quantity::new(&state.name, &state.unit);
            spec.states.push(quantity.says(&format!("State of the effect `{}`.", def.name)));
        }
    }
    Ok(spec)
}

/// Range and default value of the `i`th parameter of an effect: zero of the amplitude, the middle entry of the grid of any
/// other. Numbers that count in another scale say nothing in the model's units; but a memory needs some bound on a delay, the
/// amplitude of its effect.
fn range_and_default(parameter: &EffectParameter, i: usize) -> ([f64; 2], Option<f64>) {
    let absolute = parameter.scale == Scale::Absolute;
    let bounded = absolute || (i == 0 && parameter.scale == Scale::Sampling);
    let range = if bounded { parameter.range } else { unbounded() };
    let middle = parameter.grid.get(parameter.grid.len() / 2).copied().filter(|_| absolute);
    (range, if i == 0 { Some(0.0) } else { middle })
}

/// Refuses a name that the model already has.
fn check_new(spec: &Spec, name: &str) -> Result<(), SetupError> {
    let lists = [&spec.states, &spec.parameters, &spec.inputs, &spec.outputs];
    let taken = lists.into_iter().flatten().any(|q| q.name == name);
    if taken { Err(SetupError::Twice(name.to_owned())) } else { Ok(()) }
}
