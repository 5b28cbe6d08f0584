//! What is made of a setup: its effects by who adds them, and the specification with what they carry from window to window.
//!
//! Next files to read: [`super::split`], [`super::applied`].

use super::applied::Applied;
use super::outline::Outline;
use super::replay::Replay;
use super::split::Split;
use crate::SetupError;
use crate::effect::Extended;
use crate::setup::Setup;
use crate::solver::Description;
use crate::{EffectDef, Model, ObserverDef, Quantity, Spec, nearest};

/// What a setup of a program says of itself, with what effects carry from window to window.
///
/// # Errors
/// When an effect is unknown or more than the program takes.
pub fn spec(setup: &Setup, description: &Description) -> Result<Spec, SetupError> {
    Parts::of(setup, description).map(|parts| parts.spec)
}

/// What is made of the effects of a setup.
pub(super) struct Parts {
    /// The description with all effects' parameters and states.
    pub(super) whole: Spec,
    pub(super) spec: Spec,
    pub(super) on_inputs: Option<Applied>,
    pub(super) on_outputs: Option<Applied>,
    pub(super) hosted: Vec<EffectDef>,
}

impl Parts {
    pub(super) fn of(setup: &Setup, description: &Description) -> Result<Self, SetupError> {
        let effects = setup.written_out_effects(&description.spec)?;
        let split = Split::of(&effects, description)?;
        let constants = &setup.model.constants;
        let whole = Extended::new(Box::new(Outline::new(description)), &effects, constants)?.spec().clone();
        let applied = |replay, effects: Vec<_>| {
            (!effects.is_empty()).then(|| Applied::new(replay, effects, &whole, constants)).transpose()
        };
        let on_inputs = applied(Replay::of_inputs(&description.spec), split.inputs)?;
        let on_outputs = applied(Replay::of_outputs(&description.spec), split.outputs)?;
        let mut spec = Spec { states: description.spec.states.clone(), ..whole.clone() };
        let n_hidden = on_inputs.as_ref().map_or(0, Applied::n_state)
            + on_outputs.as_ref().map_or(0, |a| a.n_state() + description.spec.n_output());
        if n_hidden > 0 && spec.restart {
            let hidden = Quantity::new("effects:", "").size(n_hidden);
            spec.states.push(hidden.says("What effects on inputs and outputs carry from window to window."));
        }
        Ok(Self { whole, spec, on_inputs, on_outputs, hosted: split.hosted })
    }
}

/// Refuses an observer that the program does not host, and one beside effects on outputs: the program compares its own outputs
/// with the data and would pull its state towards what the effects explain.
pub(super) fn check_observer(
    observer: &ObserverDef,
    description: &Description,
    changes_outputs: bool,
) -> Result<(), SetupError> {
    let kind = observer.kind.as_str();
    if kind.is_empty() || kind == "none" {
        return Ok(());
    }
    if !description.observers.iter().any(|known| known == kind) {
        return Err(SetupError::Unknown {
            what: "observer of the solver",
            name: kind.to_owned(),
            nearest: nearest(kind, description.observers.iter()),
        });
    }
    if changes_outputs && observer.gain > 0.0 {
        let message = "an effect on an output cannot go with an observer inside the solver, which would pull the state towards \
                       what the effect explains: set the observer's kind to \"none\"";
        return Err(SetupError::Invalid(message.to_owned()));
    }
    Ok(())
}

/// Refuses initial values of states that only effects have: where those begin is said by the effects.
pub(super) fn check_initial(setup: &Setup, whole: &Spec, n_own: usize) -> Result<(), SetupError> {
    let named = setup.parameters.iter().chain(setup.model.constants.keys());
    for (name, state) in named.filter_map(|name| Some((name, name.strip_prefix("initial:")?))) {
        if Spec::range_of(&whole.states, state).is_some_and(|range| range.start >= n_own) {
            return Err(SetupError::Invalid(format!(
                "`{name}` is the initial value of an effect's own state, which cannot be given for a solver: write it into the \
                 effect"
            )));
        }
    }
    Ok(())
}
