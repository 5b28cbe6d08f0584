//! What the expressions of an effect may name, and how they are compiled.
//!
//! Names are resolved against the extended model: its states, parameters, inputs and outputs, then the study's constants.
//! Next file to read: [`super::terms`].

use std::collections::BTreeMap;

use super::EffectDef;
use crate::SetupError;
use crate::bounds::unbounded;
use crate::equations::{Expression, ExpressionError, Program, Slot};
use crate::memory::note;
use crate::{Memory, Quantity, Spec, nearest};

/// What the expressions of an effect may name.
#[derive(Clone, Copy)]
pub(crate) struct Scope<'a> {
    /// The model with the states and parameters of all effects.
    pub spec: &'a Spec,
    /// The study's fixed values.
    pub constants: &'a BTreeMap<String, f64>,
    /// What the extended model remembers.
    pub memories: &'a [Memory],
    /// Number of parameters of the model itself; those of effects follow.
    pub n_own: usize,
}

/// Which names an expression may use.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Everything.
    All,
    /// Everything but outputs, which depend on the input or parameter that the term changes.
    NoOutputs,
    /// Parameters and constants.
    Fixed,
}

impl Scope<'_> {
    /// Where a name's value is found.
    pub(super) fn slot(self, name: &str, reach: Reach) -> Option<Slot> {
        let scalar = |list: &[Quantity]| {
            let q = list.iter().find(|q| q.name == name)?;
            (q.size == 1).then(|| Spec::offset(list, name))?
        };
        let spec = self.spec;
        if let Some(delayed) = name.strip_prefix("delay:") {
            let i = self.memories.iter().position(|memory| memory.of == delayed)?;
            return Some(Slot::Input(spec.inputs.len() + i));
        }
        let parameter = || spec.parameters.iter().position(|q| q.name == name).map(Slot::Parameter);
        let constant = || self.constants.get(name).map(|&value| Slot::Constant(value));
        if reach == Reach::Fixed {
            return parameter().or_else(constant);
        }
        let output = || if reach == Reach::All { scalar(&spec.outputs).map(Slot::Output) } else { None };
        scalar(&spec.states)
            .map(Slot::State)
            .or_else(parameter)
            .or_else(|| scalar(&spec.inputs).map(Slot::Input))
            .or_else(output)
            .or_else(constant)
    }

    /// Whether an expression uses parameters and constants alone, so that its value is the same throughout a run.
    pub(super) fn is_fixed(self, text: &str) -> bool {
        let fixed =
            |name: &str| matches!(self.slot(name, Reach::All), Some(Slot::Parameter(_) | Slot::Constant(_)));
        Expression::parse(text).is_ok_and(|expression| {
            !expression.uses_time() && expression.names().iter().all(|(name, _)| fixed(name))
        })
    }

    fn names(self, reach: Reach) -> Vec<String> {
        let spec = self.spec;
        let lists = [&spec.states, &spec.parameters, &spec.inputs, &spec.outputs];
        let all = lists.into_iter().flatten().map(|q| q.name.clone());
        all.chain(self.constants.keys().cloned()).filter(|name| self.slot(name, reach).is_some()).collect()
    }

    /// Compiles one expression; `place` says in an error where it stands.
    pub(super) fn compile(self, text: &str, reach: Reach, place: &str) -> Result<Program, SetupError> {
        Expression::parse(text)
            .and_then(|expression| self.program(&expression, reach))
            .map_err(|error| located(place, text, error))
    }

    fn program(self, expression: &Expression, reach: Reach) -> Result<Program, ExpressionError> {
        let resolve = |name: &str| self.slot(name, reach);
        let close = |name: &str| nearest(name, self.names(reach));
        expression.compile(&resolve, &close)
    }

    /// Compiles the switching functions of one expression.
    pub(super) fn switches(self, text: &str, place: &str) -> Result<Vec<Program>, SetupError> {
        let compiled = || -> Result<Vec<Program>, ExpressionError> {
            let functions = Expression::parse(text)?.discontinuities();
            functions.iter().map(|g| self.program(g, Reach::All)).collect()
        };
        compiled().map_err(|error| located(place, text, error))
    }
}

fn located(place: &str, text: &str, error: ExpressionError) -> SetupError {
    SetupError::Expression {
        place: place.to_owned(),
        expression: text.to_owned(),
        column: error.column,
        message: error.message,
    }
}

/// Every name that the expressions of these effects use.
///
/// # Errors
/// When an expression does not parse.
pub fn names(defs: &[EffectDef]) -> Result<Vec<String>, SetupError> {
    let mut names = Vec::new();
    for def in defs {
        let place = format!("effect {}", def.name);
        let terms = def.adds.iter().map(|a| &a.term);
        let states = def.states.iter().flat_map(|s| [&s.rate, &s.initial]);
        for text in terms.chain(states).filter(|text| !text.is_empty()) {
            let expression = Expression::parse(text).map_err(|error| located(&place, text, error))?;
            names.extend(expression.names().into_iter().map(|(name, _)| name));
        }
    }
    Ok(names)
}

/// Adds to `list` what the expressions of an effect read of the past of states and outputs.
///
/// # Errors
/// When an expression does not parse, or a delay has no bound.
pub(crate) fn note_memories(
    def: &EffectDef,
    scope: Scope<'_>,
    list: &mut Vec<Memory>,
) -> Result<(), SetupError> {
    let kept = |name: &str| matches!(scope.slot(name, Reach::All), Some(Slot::State(_) | Slot::Output(_)));
    let range = |name: &str| match scope.constants.get(name) {
        Some(value) => [*value, *value],
        None => scope.spec.parameters.iter().find(|q| q.name == name).map_or_else(unbounded, |q| q.range),
    };
    let place = format!("effect {}", def.name);
    for text in def.adds.iter().map(|a| &a.term).chain(def.states.iter().map(|s| &s.rate)) {
        let delays = Expression::parse(text).and_then(|expression| expression.delays(&kept, &range));
        for (name, longest) in delays.map_err(|error| located(&place, text, error))? {
            note(list, &name, longest);
        }
    }
    Ok(())
}
