//! Every kind of model that a study can name.
//!
//! The list is what `Setup::build` looks kinds up in, what the `models` command prints, and what the family tests run over.
//! Next file to read: [`crate::native`] for the built-in models, [`crate::equations`] for models written in a study.

use crate::equations::EquationsModel;
use crate::setup::{ModelDef, SetupError};
use crate::{Model, Spec, equations, native, nearest};

pub use crate::equations::KIND as EQUATIONS;

/// What every kind of model says of itself, in the order of the list of built-in ones, `equations` last; the lists of
/// `equations` are empty, since the study fills them.
pub fn specs() -> Vec<Spec> {
    let built = native::all().into_iter().flatten();
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
/// When the kind is unknown, equations are missing or given for another kind, or they are wrong.
pub fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    match (&def.equations, def.kind == EQUATIONS) {
        (Some(equations), true) => {
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
    let kinds = native::kinds();
    let Some(kind) = kinds.iter().find(|kind| kind.kind == def.kind) else {
        let known = kinds.iter().map(|kind| kind.kind).chain([EQUATIONS]);
        return Err(SetupError::Unknown {
            what: "model",
            name: def.kind.clone(),
            nearest: nearest(&def.kind, known),
        });
    };
    (kind.build)(def)
}
