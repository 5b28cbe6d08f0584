//! Modulated forms of an effect, which ask whether its form is right. The output calls them bent forms.
//!
//! Each multiplies the term of the effect by something that varies along the record (time, or a state or input of the model), or
//! lets it act late. Unknown constants in the equations are tried beside them. They are not candidates and are never named: if
//! one of them lowers χ² beyond chance, the form of the effect is wrong. Next file to read: [`crate::judge::form`].

use starlings_models::EffectDef;
use starlings_models::effect::{Addition, EffectParameter, EffectState};

use crate::fit::candidate::Candidate;
use crate::judge::gates::JudgedFit;
use crate::locate::Track;

/// Signals that a term is multiplied by, at most.
const SIGNALS: usize = 5;
/// Equations that get an unknown constant, at most.
const CONSTANTS: usize = 3;
/// Time constants of a late effect, as shares of the record.
const LATE: [f64; 2] = [0.01, 0.06];

/// The modulated forms of the effects of a variant. `tracks` are the courses of the model, `span` is that of the training data.
pub(super) fn modulated_forms(judged: &JudgedFit<'_>, tracks: &[Track], span: [f64; 2]) -> Vec<Candidate> {
    let [from, to] = span;
    // Beyond the training span the time is held constant, since no fit has seen how the modulation would continue.
    let time = format!("(min(t, {to:?}) - {:?})/{:?}", 0.5 * (from + to), 0.5 * (to - from));
    // A term that adds to an input or a parameter may not read outputs, so states and inputs are taken.
    let spec = &judged.fit.variant.study.spec;
    let may = |t: &&Track| spec.states.iter().chain(&spec.inputs).any(|q| q.name == t.name);
    let signals: Vec<&Track> = tracks.iter().filter(may).filter(|t| varies(t)).take(SIGNALS).collect();
    let mut forms = Vec::new();
    for effect in &judged.fit.variant.effects {
        let def = &effect.candidate.def;
        forms.push(multiplied(def, "time", &time));
        forms.extend(signals.iter().map(|track| multiplied(def, &track.name, &normalised(track))));
        forms.extend(LATE.into_iter().enumerate().map(|(i, share)| late(def, i, share * (to - from))));
    }
    forms.into_iter().map(Candidate::new).collect()
}

/// An unknown constant in each of the first equations of the model.
pub(super) fn constants(judged: &JudgedFit<'_>) -> Vec<Candidate> {
    let scalar = judged.fit.variant.study.spec.states.iter().filter(|q| q.size == 1).take(CONSTANTS);
    scalar.map(|q| Candidate::new(constant(&q.name))).collect()
}

/// An unknown constant in the equation of a state.
fn constant(state: &str) -> EffectDef {
    let name = format!("bent_constant_{state}");
    EffectDef {
        name: format!("a constant in the equation of {state}"),
        adds: vec![Addition { to: state.to_owned(), term: name.clone() }],
        parameters: vec![parameter(&name)],
        ..EffectDef::default()
    }
}

fn varies(track: &Track) -> bool {
    let [lo, hi] = track.ends();
    hi - lo > 1e-9 * hi.abs().max(lo.abs()) && hi.is_finite() && lo.is_finite()
}

/// A signal as a number between −1 and 1.
fn normalised(track: &Track) -> String {
    let [lo, hi] = track.ends();
    format!("({} - {:?})/{:?}", track.name, 0.5 * (lo + hi), 0.5 * (hi - lo))
}

/// The name of the coefficient of a modulated form.
fn coefficient(def: &EffectDef, what: &str) -> String {
    let letters = |c: char| if c.is_alphanumeric() { c } else { '_' };
    format!("bent_{}_by_{}", def.name, what).chars().map(letters).collect()
}

fn parameter(name: &str) -> EffectParameter {
    EffectParameter { name: name.to_owned(), ..EffectParameter::default() }
}

/// The term multiplied by an expression between −1 and 1.
fn multiplied(def: &EffectDef, what: &str, by: &str) -> EffectDef {
    let name = coefficient(def, what);
    let bend =
        |add: &Addition| Addition { to: add.to.clone(), term: format!("{name}*({})*({by})", add.term) };
    EffectDef {
        name: format!("{} bent by {what}", def.name),
        adds: def.adds.iter().map(bend).collect(),
        parameters: vec![parameter(&name)],
        ..EffectDef::default()
    }
}

/// The term as it was a while ago, less the term as it is.
fn late(def: &EffectDef, i: usize, lag: f64) -> EffectDef {
    let name = coefficient(def, &format!("late_{i}"));
    let state = |k: usize| format!("s_{name}_{k}");
    let bend = |(k, add): (usize, &Addition)| Addition {
        to: add.to.clone(),
        term: format!("{name}*({} - ({}))", state(k), add.term),
    };
    let states = def.adds.iter().enumerate().map(|(k, add)| EffectState {
        name: state(k),
        initial: "0".to_owned(),
        rate: format!("(({}) - {})/{lag:?}", add.term, state(k)),
        ..EffectState::default()
    });
    EffectDef {
        name: format!("{} late {i}", def.name),
        adds: def.adds.iter().enumerate().map(bend).collect(),
        parameters: vec![parameter(&name)],
        states: states.collect(),
        ..EffectDef::default()
    }
}
