//! Which effects a program of its own takes over, and which are applied to its inputs and outputs.
//!
//! A term on a state goes to a solver that hosts that state; a term on an input changes the signal before the run, one on an
//! output the prediction after it. An effect does one of these. Next file to read: [`mod@super::applied`].

use crate::EffectDef;
use crate::SetupError;
use crate::effect::Target;
use crate::solver::Description;

/// The effects of a setup by who adds them, each in its order.
#[derive(Clone, Debug, Default)]
pub(super) struct Split {
    /// Added to inputs before the run.
    pub(super) inputs: Vec<EffectDef>,
    /// Added to outputs after the run.
    pub(super) outputs: Vec<EffectDef>,
    /// Sent to the solver.
    pub(super) hosted: Vec<EffectDef>,
}

impl Split {
    /// Sorts effects, written out.
    ///
    /// # Errors
    /// When an effect is neither hosted by the solver nor an addition to inputs or outputs alone.
    pub(super) fn of(effects: &[EffectDef], description: &Description) -> Result<Self, SetupError> {
        let mut split = Self::default();
        for effect in effects {
            let spec = &description.spec;
            let target = |add| Target::of(add, effect, spec, spec.parameters.len());
            let targets: Vec<Option<Target>> = effect.adds.iter().map(target).collect();
            let all = |wanted| targets.iter().all(|t| *t == Some(wanted));
            if all(Target::Input) {
                split.inputs.push(effect.clone());
            } else if all(Target::Output) {
                split.outputs.push(effect.clone());
            } else if all(Target::Rate) {
                check_hosted(effect, description)?;
                split.hosted.push(effect.clone());
            } else {
                return Err(SetupError::Invalid(format!(
                    "effect `{}` cannot be added to the solver `{}`: from outside, a term reaches either its inputs, or its \
                     outputs, or the rates of states that it hosts",
                    effect.name, description.name
                )));
            }
        }
        Ok(split)
    }
}

fn check_hosted(effect: &EffectDef, description: &Description) -> Result<(), SetupError> {
    let name = &description.name;
    if let Some(add) = effect.adds.iter().find(|add| !description.hosts.contains(&add.to)) {
        let hosts = if description.hosts.is_empty() {
            "it hosts none".to_owned()
        } else {
            format!("it hosts {}", description.hosts.join(", "))
        };
        return Err(SetupError::Invalid(format!(
            "effect `{}` adds to the rate of `{}`, which the solver `{name}` does not host ({hosts})",
            effect.name, add.to
        )));
    }
    if !effect.states.is_empty() {
        return Err(SetupError::Invalid(format!(
            "effect `{}` brings states of its own, which the solver `{name}` cannot host",
            effect.name
        )));
    }
    Ok(())
}
