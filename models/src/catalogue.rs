//! Every kind of model that a study can name.
//!
//! The list is what a setup's kind is looked up in, what the `models` command prints, and what the family tests run over. A
//! model is listed by the crate of its family; the families are listed here. Next files to read: [`crate::build`],
//! and in `models/core` `native_models.rs` for lists and `equations.rs` for models written in a study.

use std::collections::HashSet;

use starlings_models_core::equations::{self, EquationsModel};
use starlings_models_core::{
    Model, ModelDef, NativeModels, SOLVER, SetupError, Spec, external, layout, nearest,
};

pub use starlings_models_core::equations::KIND as EQUATIONS;

/// The built-in models, one entry per family.
pub const NATIVE: NativeModels = NativeModels::of(&[
    starlings_haemodynamics::MODELS,
    starlings_propulsion::MODELS,
    starlings_structures::MODELS,
]);

/// What every kind of model says of itself, in the order of the list of built-in ones, `equations` last; the lists of
/// `equations` are empty, since the study fills them.
pub fn specs() -> Vec<Spec> {
    let built = NATIVE.all().into_iter().flatten();
    let mut specs: Vec<Spec> = built.map(|model| model.spec().clone()).collect();
    specs.push(Spec {
        kind: EQUATIONS.to_owned(),
        says: equations::SAYS.to_owned(),
        states: Vec::new(),
        parameters: Vec::new(),
        outputs: Vec::new(),
        inputs: Vec::new(),
        measures: Vec::new(),
        restart: true,
    });
    specs
}

/// Makes the model that a definition names, without effects.
///
/// # Errors
/// When the kind is unknown, equations are missing or given for another kind, or they are wrong, or a layout gives two
/// quantities one name.
pub fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    if def.kind == SOLVER {
        layout::none(def)?;
        let description = def.description().ok_or_else(|| {
            SetupError::Invalid("model kind `solver` needs a description of the solver".to_owned())
        })?;
        check_names(&description.spec)?;
        return Ok(external::outline(description));
    }
    match (&def.equations, def.kind == EQUATIONS) {
        (Some(equations), true) => {
            layout::none(def)?;
            return Ok(Box::new(EquationsModel::with_constants(equations, &def.constants)?));
        }
        (None, true) => {
            let message = "model kind `equations` needs its states: give at least one, with a rate";
            return Err(SetupError::Invalid(message.to_owned()));
        }
        (Some(_), false) => {
            return Err(SetupError::Invalid(format!(
                "model kind `{}` has its own equations: remove the states, or set kind to `equations`",
                def.kind
            )));
        }
        (None, false) => {}
    }
    let Some(native) = NATIVE.find(&def.kind) else {
        let known = NATIVE.iter().map(|native| native.kind).chain([EQUATIONS]);
        return Err(SetupError::Unknown {
            what: "model",
            name: def.kind.clone(),
            nearest: nearest(&def.kind, known),
        });
    };
    let model = (native.build)(def)?;
    check_names(model.spec())?;
    Ok(model)
}

/// Refuses two quantities of one name in one list: names put together from those of a layout can meet.
fn check_names(spec: &Spec) -> Result<(), SetupError> {
    for list in [&spec.states, &spec.parameters, &spec.outputs, &spec.inputs] {
        let mut known = HashSet::new();
        if let Some(twice) = list.iter().find(|quantity| !known.insert(quantity.name.as_str())) {
            return Err(SetupError::Twice(twice.name.clone()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models_core::Quantity;

    #[test]
    fn two_quantities_of_one_name_are_refused_unless_they_stand_in_different_lists() {
        let mut spec = specs().remove(0);
        let name = spec.states[0].name.clone();
        assert_eq!(check_names(&spec), Ok(()));
        spec.outputs.insert(0, Quantity::new("another", ""));
        spec.inputs[0].name = "another".to_owned();
        assert_eq!(check_names(&spec), Ok(()));
        let refused = Err(SetupError::Twice("another".to_owned()));
        spec.outputs.push(Quantity::new("another", ""));
        assert_eq!(check_names(&spec), refused);
        spec.outputs.pop();
        spec.parameters.push(Quantity::new("another", ""));
        spec.parameters.insert(0, Quantity::new("another", ""));
        assert_eq!(check_names(&spec), refused);
        spec.parameters.remove(0);
        spec.states.push(Quantity::new(&name, ""));
        assert_eq!(check_names(&spec), Err(SetupError::Twice(name)));
    }
}
