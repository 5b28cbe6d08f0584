//! Which effects are tried: those of the library and of the study, less what the model has already and what was left out.
//!
//! A wrong name or an empty list is an error before the first run. Next file to read: [`crate::options`].

use starlings_models::effect::library::{FAMILIES, family_of, library_in, shows_in};
use starlings_models::{BuildSetup, EffectDef, Setup, did_you_mean, nearest};
use starlings_study::Study;
use starlings_study::checked::{Library, PROPOSALS};

use crate::error::ExplainError;
use crate::fit::kind::Kind;
use crate::fit::same_form::same_form;
use crate::number::three;
use crate::options::Options;
use crate::screen::springs::lacks_spring;

/// The effects to try, those of the study first.
///
/// # Errors
/// When the model does not build without its effects, a name of `only` or `without` is not among the effects, or none is left.
pub fn candidates(study: &Study, options: &Options) -> Result<Vec<EffectDef>, ExplainError> {
    let bare = Setup { model: study.setup.model.clone(), ..Setup::default() };
    let spec = bare.spec()?;
    let fitted: Vec<String> = fitted_outputs(study);
    let mut built_in = library_in(&spec, &study.time_unit);
    let given = || options.only.iter().chain(&options.without);
    let is_named = |effect: &EffectDef| given().any(|name| names(name, &effect.name));
    let has_place = |effect: &EffectDef| is_named(effect) || !lacks_spring(study, &spec, effect);
    built_in.retain(|effect| shows_in(effect, &spec, &fitted) && has_place(effect));
    let all: Vec<&EffectDef> = match study.explain.library {
        Library::All => study.candidates.iter().chain(&built_in).collect(),
        Library::Study => study.candidates.iter().collect(),
        Library::BuiltIn => built_in.iter().collect(),
    };
    for name in options.only.iter().chain(&options.without) {
        check_name(name, study, &all)?;
    }
    let own = |effect: &EffectDef| study.candidates.iter().any(|c| c.name == effect.name);
    let is_in = |list: &[String], effect: &EffectDef| {
        let family = || family_of(&effect.name).filter(|_| !own(effect));
        list.iter().any(|name| names(name, &effect.name))
            || family().is_some_and(|f| list.iter().any(|name| name == f))
    };
    let in_model = |effect: &EffectDef| {
        study.setup.effects.iter().any(|known| known.name == effect.name || known.adds == effect.adds)
    };
    // A generic term that has a name already is tried under that name.
    let named: Vec<&EffectDef> = all.iter().copied().filter(|e| !is_generic(study, e)).collect();
    let mut kept: Vec<EffectDef> = Vec::new();
    for effect in &all {
        let wanted = options.only.is_empty() || is_in(&options.only, effect);
        let repeated = kept.iter().any(|known| known.name == effect.name || known.adds == effect.adds)
            || (is_generic(study, effect) && named.iter().any(|known| same_form(known, effect)));
        if wanted && !is_in(&options.without, effect) && !in_model(effect) && !repeated {
            kept.push((*effect).clone());
        }
    }
    if kept.is_empty() {
        return Err(ExplainError::NothingToTry(nothing_to_try(study, options, all.len())));
    }
    Ok(kept)
}

/// Where an effect comes from.
pub(crate) fn kind_of(study: &Study, name: &str) -> Kind {
    if study.candidates.iter().any(|candidate| candidate.name == name) {
        Kind::Study
    } else {
        Kind::built_in(name)
    }
}

fn is_generic(study: &Study, effect: &EffectDef) -> bool {
    kind_of(study, &effect.name) == Kind::Generic
}

/// Outputs that a fitted channel measures.
pub(crate) fn fitted_outputs(study: &Study) -> Vec<String> {
    let channels = study.records.iter().filter(|r| r.is_trained()).flat_map(|r| &r.channels);
    channels.filter(|c| !c.held_out).map(|c| c.output.clone()).collect()
}

/// Powers of ten by which a noise and the largest recorded value may differ: beyond them the smaller is lost in the rounding of
/// the larger.
const APART: f64 = 1e15;

/// Refuses a noise below the last digit of the values, or so far above them that no misfit could exceed it.
fn check_noise(study: &Study) -> Result<(), ExplainError> {
    for record in study.records.iter() {
        for channel in &record.channels {
            let known = channel.values.iter().filter(|v| v.is_finite());
            let largest = known.fold(0.0_f64, |most, v| most.max(v.abs()));
            let size = if largest > 0.0 { largest } else { 1.0 };
            let ratio = channel.noise / size;
            if (1.0 / APART..=APART).contains(&ratio) {
                continue;
            }
            let why = if ratio < 1.0 { "below the last digit of" } else { "so far above" };
            let what = if ratio < 1.0 { "" } else { " that nothing could show" };
            return Err(ExplainError::Noise(format!(
                "the noise of {} in record `{}`, {}, lies {why} its values, the largest of which is {}{what}: give the standard \
                 deviation of the measurement error in the channel's unit, or \"auto\"",
                channel.output,
                record.name,
                three(channel.noise),
                three(largest)
            )));
        }
    }
    Ok(())
}

/// Checks what can be checked before the first run: the names, that an effect is left, the noise against the values, the budget
/// against one set of runs of the fit.
///
/// # Errors
/// The first fault found.
pub fn check(study: &Study, options: &Options) -> Result<(), ExplainError> {
    candidates(study, options)?;
    check_noise(study)?;
    let trained = study.records.iter().filter(|record| record.is_trained()).count();
    let needed = (trained * (study.theta.len() + 1)) as u64;
    match options.budget.or(study.explain.budget) {
        Some(budget) if budget < needed => {
            Err(ExplainError::Budget { budget, stage: "fit", needed: needed - budget })
        }
        _ => Ok(()),
    }
}

/// Whether a name is that of an effect, or of an effect at any of its places: `leak` is `leak:h1` and `leak:h2` too.
fn names(name: &str, effect: &str) -> bool {
    effect.strip_prefix(name).is_some_and(|place| place.is_empty() || place.starts_with(':'))
}

/// Refuses an unknown name of an effect or a family. An effect that the model has already may be named; this has no influence.
fn check_name(name: &str, study: &Study, all: &[&EffectDef]) -> Result<(), ExplainError> {
    let effects = all.iter().copied().chain(&study.setup.effects).map(|e| e.name.as_str());
    let known: Vec<&str> =
        effects.chain(FAMILIES.iter().map(|family| family.name)).chain([PROPOSALS]).collect();
    if known.iter().any(|known| names(name, known)) {
        return Ok(());
    }
    let help = match nearest(name, &known) {
        Some(near) => did_you_mean(near),
        None => "`starlings effects STUDY` lists what would be tried".to_owned(),
    };
    Err(ExplainError::Name(format!("no effect is named `{name}`: {help}")))
}

/// The message that no effect is left to try, with the remedy.
fn nothing_to_try(study: &Study, options: &Options, n_all: usize) -> String {
    let library = match study.explain.library {
        Library::All => "the study and the built-in library",
        Library::Study => "the study (library = \"study\")",
        Library::BuiltIn => "the built-in library (library = \"built-in\")",
    };
    let (n_without, n_only) = (options.without.len(), options.only.len());
    if n_all == 0 {
        let kind = &study.setup.model.kind;
        return format!(
            "there is no effect to try: {library} offers none for model `{kind}`; describe one as [[effects]], or give states \
             and outputs their roles so that the built-in effects find their places"
        );
    }
    format!(
        "there is no effect left to try: {library} offers {n_all}, less what is in the model already, {n_without} in \
         `without`{}; leave out fewer",
        if n_only == 0 { String::new() } else { format!(", and all but {n_only} in `only`") }
    )
}

#[cfg(test)]
mod tests {
    use super::names;

    #[test]
    fn a_name_is_that_of_an_effect_and_of_all_of_its_places_and_of_no_longer_name() {
        assert!(names("leak", "leak") && names("leak", "leak:h1") && names("leak:h1", "leak:h1"));
        assert!(!names("leak", "leakage") && !names("leak:h1", "leak:h2") && !names("leak:h1", "leak"));
    }
}
