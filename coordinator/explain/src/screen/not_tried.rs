//! What the search did not try, and why: families of effects that find no place in the model, and equations to which no candidate
//! adds a term.
//!
//! That nothing explains the gap is said of the candidates only, and so the result lists what was not among them. Next file to
//! read: [`super::candidates`].

use serde::{Deserialize, Serialize};
use starlings_models::effect::library::{FAMILIES, library_in, shows_in};
use starlings_models::{BuildSetup, EffectDef, Quantity, Role, Setup, Spec};
use starlings_study::{Study, checked::Library, listed};

use super::candidates::fitted_outputs;
use super::springs::lacks_spring;
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;

/// States that a sentence names at most.
const MOST: usize = 6;

/// A kind of physics of which nothing was tried.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotTried {
    /// A family of the built-in effects, or `the equation of X`.
    pub kind: String,
    /// Why not, in words.
    pub reason: String,
}

/// What was not tried: families of the library first, then equations.
pub(crate) fn not_tried(study: &Study, candidates: &[Candidate]) -> Vec<NotTried> {
    let bare = Setup { model: study.setup.model.clone(), ..Setup::default() };
    let Ok(spec) = bare.spec() else { return Vec::new() };
    let measured = fitted_outputs(study);
    let tried = |effect: &EffectDef| candidates.iter().any(|c| c.name() == effect.name);
    let mut list = Vec::new();
    for family in FAMILIES {
        let mut grown = family.grow(&spec, &study.time_unit);
        grown.retain(|effect| shows_in(effect, &spec, &measured));
        let reason = if grown.is_empty() {
            format!("the model has no place for its effects; {}", lower(family.needs))
        } else if grown.iter().any(tried) {
            continue;
        } else if study.explain.library == Library::Study {
            "`library = \"study\"` leaves the built-in effects out".to_owned()
        } else {
            "`only` or `without` leaves it out, or the model has it already".to_owned()
        };
        list.push(NotTried { kind: family.name.to_owned(), reason });
    }
    list.extend(without_spring(study, &spec, candidates));
    list.extend(untouched(&spec, candidates).into_iter().map(|(state, role)| NotTried {
        kind: format!("the equation of {state}"),
        reason: if role == Role::Other {
            format!("{state} has no role from which the library grows effects, and no [[effects]] adds to it")
        } else {
            format!("no candidate adds to the rate of {state}")
        },
    }));
    list
}

/// Effects of a spring that the model has none for.
fn without_spring(study: &Study, spec: &Spec, candidates: &[Candidate]) -> Option<NotTried> {
    let mut grown = library_in(spec, &study.time_unit);
    grown.retain(|effect| {
        lacks_spring(study, spec, effect) && candidates.iter().all(|c| c.name() != effect.name)
    });
    let mut rates: Vec<&str> = grown.iter().flat_map(|e| &e.adds).map(|add| add.to.as_str()).collect();
    rates.sort_unstable();
    rates.dedup();
    let names: Vec<&str> = grown.iter().map(|effect| effect.name.as_str()).collect();
    let reason = format!(
        "no displacement enters the rate of {}: the model has no spring that they could change; --only with the name of one tries it all the same",
        listed(&rates)
    );
    let is_left_out = !names.is_empty() && study.explain.library != Library::Study;
    is_left_out.then(|| NotTried { kind: listed(&names), reason })
}

/// Scalar states whose rate no candidate adds to, with their role.
fn untouched<'s>(spec: &'s Spec, candidates: &[Candidate]) -> Vec<(&'s str, Role)> {
    let adds = |name: &str| candidates.iter().any(|c| c.def.adds.iter().any(|add| add.to == name));
    // The rate of a displacement is a velocity by definition.
    let open = |q: &&Quantity| q.size == 1 && q.role != Role::Displacement && !adds(&q.name);
    let scalar = spec.states.iter().filter(open);
    scalar.map(|q| (q.name.as_str(), q.role)).collect()
}

/// Which equations no candidate adds a term to, in one sentence with a remedy. Empty where there is none, or where a candidate
/// adds to a parameter, which may act in any equation.
pub(crate) fn sentence(study: &Study, candidates: &[Candidate]) -> String {
    let bare = Setup { model: study.setup.model.clone(), ..Setup::default() };
    let Ok(spec) = bare.spec() else { return String::new() };
    let open = untouched(&spec, candidates);
    let is = |list: &[Quantity], name: &str| list.iter().any(|q| q.name == name);
    let to_parameter = |to: &str| !is(&spec.states, to) && is(&spec.parameters, to);
    if open.is_empty() || candidates.iter().any(|c| c.def.adds.iter().any(|add| to_parameter(&add.to))) {
        return String::new();
    }
    let names: Vec<&str> = open.iter().map(|(name, _)| *name).collect();
    let names = if names.len() > MOST {
        format!("{} and {} more", names[..MOST - 1].join(", "), names.len() + 1 - MOST)
    } else {
        listed(&names)
    };
    let equations = if open.len() == 1 { "equation" } else { "equations" };
    let roleless = open.iter().all(|(_, role)| *role == Role::Other);
    let (why, remedy) =
        if roleless && study.explain.library != Library::Study && study.setup.model.equations.is_some() {
            let of =
                if open.len() == 1 { "that state has no role" } else { "none of these states has a role" };
            (
                format!(": {of} from which effects of the library grow"),
                "give roles or list effects in [[effects]]",
            )
        } else {
            (String::new(), "list effects in [[effects]]")
        };
    format!("No candidate adds a term to the {equations} of {names}{why}; {remedy}.")
}

/// That no state of the equations has a role from which effects of the library grow, with the families that found no place for it; nothing where
/// effects of a field were tried, or [`sentence`] tells it.
pub(crate) fn without_roles(study: &Study, candidates: &[Candidate]) -> Option<String> {
    let has_physics = candidates.iter().any(|candidate| candidate.kind == Kind::Library);
    let is_told = !sentence(study, candidates).is_empty();
    if has_physics
        || is_told
        || study.explain.library == Library::Study
        || study.setup.model.equations.is_none()
    {
        return None;
    }
    let bare = Setup { model: study.setup.model.clone(), ..Setup::default() };
    let spec = bare.spec().ok().filter(|spec| spec.states.iter().all(|q| q.role == Role::Other))?;
    let without = FAMILIES.iter().filter(|family| family.grow(&spec, &study.time_unit).is_empty());
    let without: Vec<&str> = without.map(|family| family.name).collect();
    (!without.is_empty()).then(|| {
        format!(
            "no state has a role, nor a unit that tells it: effects of the families {} found no place, and what was tried of the \
             library are errors of instruments and terms of no particular physics; give `role` in [[model.states]]",
            listed(&without)
        )
    })
}

/// What a family needs, as part of another sentence.
fn lower(sentence: &str) -> String {
    let text = sentence.trim_end_matches('.');
    let mut letters = text.chars();
    let needs =
        letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect());
    format!("it needs: {needs}")
}
