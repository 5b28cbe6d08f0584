//! What can be checked of equations before their expressions are looked at.
//!
//! Next file to read: [`super::build`].

use std::collections::BTreeSet;

use super::def::{EquationsDef, Method, SolverDef};
use super::parse;
use crate::integrate::{Solver, Tolerance};
use crate::{SetupError, nearest};

/// Names are usable and given once.
pub(super) fn names(def: &EquationsDef) -> Result<(), SetupError> {
    if def.states.is_empty() {
        return Err(SetupError::Invalid(
            "the equations have no state: add at least one with a rate".to_owned(),
        ));
    }
    let mut seen = BTreeSet::new();
    let mut outputs = BTreeSet::new();
    let states = def.states.iter().map(|s| (&s.name, "a state"));
    let inputs = def.inputs.iter().map(|s| (&s.name, "an input"));
    for (name, what) in states.chain(inputs).chain(def.outputs.iter().map(|s| (&s.name, "an output"))) {
        usable(name, what)?;
        let value = || def.outputs.iter().find(|o| o.name == *name).map(|o| o.value.trim());
        let is_state =
            what == "an output" && def.states.iter().any(|s| s.name == *name) && value() == Some(name);
        let list = if is_state { &mut outputs } else { &mut seen };
        if !list.insert(name) {
            return Err(SetupError::Twice(name.clone()));
        }
    }
    Ok(())
}

/// Whether a word means something in expressions, so that nothing else can have it as its name.
pub fn has_meaning(name: &str) -> bool {
    ["t", "pi"].contains(&name) || parse::FUNCTIONS.contains(&name)
}

/// The name can stand in an expression; `what` says with its article what it names.
pub(crate) fn usable(name: &str, what: &str) -> Result<(), SetupError> {
    let mut letters = name.chars();
    let starts = letters.next().is_some_and(|c| c.is_alphabetic() || c == '_');
    let why = if !starts || !letters.all(|c| c.is_alphanumeric() || c == '_') {
        "expected a letter or `_`, then letters, digits and `_`"
    } else if has_meaning(name) {
        "it has a meaning in expressions"
    } else {
        return Ok(());
    };
    Err(SetupError::Invalid(format!("`{name}` cannot be the name of {what}: {why}")))
}

/// The range of `what` has its smallest value first.
pub(crate) fn range([lo, hi]: [f64; 2], what: &str) -> Result<(), SetupError> {
    if lo <= hi {
        return Ok(());
    }
    Err(SetupError::Invalid(format!("the range of {what} is [{lo}, {hi}]: give the smallest value first")))
}

/// Every state has a rate, an initial value and a range, and replaceable terms exist.
pub(super) fn terms(def: &EquationsDef) -> Result<(), SetupError> {
    for state in &def.states {
        if state.rate.is_empty() {
            return Err(SetupError::Invalid(format!("state `{}` has no rate", state.name)));
        }
        if state.initial.trim().is_empty() {
            return Err(SetupError::Invalid(format!("state `{}` has no initial value", state.name)));
        }
        range(state.range, &format!("state `{}`", state.name))?;
        let mut sources = BTreeSet::new();
        if let Some((source, _)) = state.noise.iter().find(|(source, _)| !sources.insert(source)) {
            return Err(SetupError::Twice(format!("{source} in the noise of {}", state.name)));
        }
        let takes_noise = matches!(def.solver.method, Method::Heun | Method::EulerMaruyama);
        if !state.noise.is_empty() && !takes_noise {
            return Err(SetupError::Invalid(format!(
                "the noise of state `{}` needs a solver for it: `method = \"heun\"` (Stratonovich) or \
                 `\"euler-maruyama\"` (Itô), with its `step`",
                state.name
            )));
        }
        let mut seen = BTreeSet::new();
        if let Some((term, _)) = state.rate.iter().find(|(term, _)| !seen.insert(term)) {
            return Err(SetupError::Twice(format!("{term} in the rate of {}", state.name)));
        }
    }
    let all = || def.states.iter().flat_map(|s| s.rate.iter().map(|(term, _)| term.as_str()));
    for name in &def.replaceable {
        if !all().any(|term| term == name) {
            let nearest = nearest(name, all());
            return Err(SetupError::Unknown { what: "rate term", name: name.clone(), nearest });
        }
    }
    Ok(())
}

/// The integrator that the definition asks for.
pub(super) fn solver(def: &SolverDef) -> Result<Solver, SetupError> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    let tolerance = Tolerance { relative: def.rtol, absolute: def.atol };
    if !positive(def.rtol) || !positive(def.atol) {
        return Err(SetupError::Invalid("the solver's rtol and atol must be positive numbers".to_owned()));
    }
    match (def.method, def.step) {
        (Method::Auto, _) => Ok(Solver::Auto(tolerance)),
        (Method::Dopri5, _) => Ok(Solver::Dopri5(tolerance)),
        (Method::Rosenbrock, _) => Ok(Solver::Rosenbrock(tolerance)),
        (Method::Fixed, Some(step)) if positive(step) => Ok(Solver::Fixed { step }),
        (Method::Heun, Some(step)) if positive(step) => Ok(Solver::Heun { step }),
        (Method::EulerMaruyama, Some(step)) if positive(step) => Ok(Solver::EulerMaruyama { step }),
        (Method::Fixed | Method::Heun | Method::EulerMaruyama, _) => {
            let name = def.method.name();
            Err(SetupError::Invalid(format!("the solver's method `{name}` needs a positive `step`")))
        }
    }
}
