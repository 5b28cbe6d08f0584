//! What can be wrong with what a solver answers, each in half a sentence that follows the solver's name.
//!
//! Said here as well as where every prediction is checked, since only here the program's output is at hand. Next file to read:
//! [`super`].

use starlings_models::{ModelFailure, ParticleError, Run, Solved, Spec};

/// Letters of a solver's own words that a message repeats.
const LONGEST: usize = 2000;

/// What is wrong with an answer of this length; nothing where it is sound. It says nothing of the parameters by itself.
pub(super) fn wrong_length(spec: &Spec, run: &Run<'_>, solved: &Solved) -> Option<String> {
    let length = |what: &str, got: usize, wanted: usize| {
        (got != wanted).then(|| format!("returned {got} {what} where {wanted} belong"))
    };
    length("output values", solved.outputs.len(), run.window.observed.len())
        .or_else(|| length("state values", solved.state.len(), spec.n_state()).filter(|_| spec.restart))
}

/// The first value of an answer of the right length that is not finite; nothing where there is none.
pub(super) fn not_finite(spec: &Spec, run: &Run<'_>, solved: &Solved) -> Option<String> {
    let window = run.window;
    let of_outputs = || {
        let at = solved.outputs.iter().position(|value| !value.is_finite())?;
        let n_row = solved.outputs.len() / window.times.len().max(1);
        let (time, value) = (window.times[at / n_row.max(1)], solved.outputs[at]);
        let name = output(spec, run, at % n_row.max(1));
        Some(format!("returned {value}: output `{name}` is not a finite number at t = {time}"))
    };
    of_outputs().or_else(|| {
        let at = solved.state.iter().position(|value| !value.is_finite()).filter(|_| spec.restart)?;
        let time = window.times.last().copied().unwrap_or(window.start);
        let (name, value) = (Spec::component(&spec.states, at), solved.state[at]);
        Some(format!("returned {value}: state `{name}` is not a finite number at t = {time}"))
    })
}

/// Name of a row of the outputs that were asked for.
fn output(spec: &Spec, run: &Run<'_>, row: usize) -> String {
    let known = |name: &String| spec.outputs.iter().find(|q| q.name == *name).cloned();
    let asked: Vec<_> = run.outputs.iter().filter_map(known).collect();
    Spec::component(&asked, row)
}

/// A failure that a solver reports, in words that follow its name.
pub(super) fn reported(error: ParticleError) -> ParticleError {
    match error {
        ParticleError::Undecided(text) if text.trim().is_empty() => {
            ParticleError::Undecided("reports a failure and does not say which".to_owned())
        }
        ParticleError::Undecided(text) => ParticleError::Undecided(format!("reports: {text}")),
        other => other,
    }
}

/// The beginning of a long text.
pub(super) fn short(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

/// A failure of the model as the solver of this name tells it.
pub(super) fn named(name: &str, failed: ModelFailure, tail: &str) -> ModelFailure {
    match failed {
        ModelFailure::Solver(text) => {
            ModelFailure::Solver(format!("the solver `{name}` {}{tail}", short(&text)))
        }
        ModelFailure::OutsideDomain(text) => {
            ModelFailure::OutsideDomain(format!("the solver `{name}` reports: {}{tail}", short(&text)))
        }
        ModelFailure::NotFinite { what, time } if time.is_finite() => {
            ModelFailure::NotFinite { what: format!("{} of the solver `{name}`", short(&what)), time }
        }
        ModelFailure::NotFinite { what, .. } => ModelFailure::Solver(format!(
            "the solver `{name}` says that {} is not a finite number{tail}",
            short(&what)
        )),
        other => other,
    }
}
