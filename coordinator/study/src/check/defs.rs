//! Equations and effects of a study file as the definitions of which models are built.
//!
//! Nothing is built here. Next file to read: [`super::model`].

use starlings_models::EffectDef;
use starlings_models::effect::{Addition, EffectParameter, EffectState};
use starlings_models::equations::{EquationsDef, InputDef, Method, OutputDef, SolverDef, StateDef};
use toml::Spanned;

use crate::file::{EffectSection, EquationsSection, SolverSection, StateSection};
use crate::problem::Source;

pub(super) fn equations(source: &Source, section: &EquationsSection) -> EquationsDef {
    EquationsDef {
        states: section.states.iter().map(state).collect(),
        outputs: section
            .outputs
            .iter()
            .map(|o| OutputDef {
                name: o.name.get_ref().clone(),
                unit: o.unit.clone(),
                role: o.role,
                value: o.value.get_ref().clone(),
            })
            .collect(),
        inputs: section
            .inputs
            .iter()
            .map(|i| InputDef { name: i.name.get_ref().clone(), unit: i.unit.clone(), role: i.role })
            .collect(),
        replaceable: section.replaceable.iter().map(|r| r.get_ref().clone()).collect(),
        roles: section.roles.iter().map(|(name, role)| (name.get_ref().clone(), *role)).collect(),
        solver: solver(source, &section.solver),
    }
}

fn state(section: &StateSection) -> StateDef {
    let name = section.name.get_ref();
    let term = |(term, text): &(Spanned<String>, Spanned<String>)| {
        let term = if term.get_ref().is_empty() { name } else { term.get_ref() };
        (term.clone(), text.get_ref().clone())
    };
    StateDef {
        name: name.clone(),
        unit: section.unit.clone(),
        role: section.role.unwrap_or_default(),
        initial: section.initial.get_ref().clone(),
        rate: section.rate.iter().map(term).collect(),
        noise: section.noise.iter().map(term).collect(),
        ..StateDef::default()
    }
}

fn solver(source: &Source, section: &SolverSection) -> SolverDef {
    let default = SolverDef::default();
    let mut method = default.method;
    if let Some(word) = &section.method {
        if let Some(known) = Method::ALL.into_iter().find(|known| known.name() == word.get_ref()) {
            method = known;
        } else {
            let valid: Vec<String> = Method::ALL.iter().map(|known| known.name().to_owned()).collect();
            source.report_unknown(word.span(), format!("unknown method `{}`", word.get_ref()), &valid);
        }
    }
    if method.has_fixed_step() && section.step.is_none() {
        let help = "give `step = ...` in the study's time unit";
        let message = format!("the method \"{}\" needs its `step`", method.name());
        source.report_with(section.span.clone(), message, help);
    }
    for (key, value) in [("rtol", &section.rtol), ("atol", &section.atol), ("step", &section.step)] {
        if let Some(value) = value.as_ref().filter(|v| *v.get_ref() <= 0.0) {
            source.report(value.span(), format!("`{key}` must be above zero, found {}", value.get_ref()));
        }
    }
    let number = |value: &Option<Spanned<f64>>| value.as_ref().map(|v| *v.get_ref());
    SolverDef {
        method,
        rtol: number(&section.rtol).unwrap_or(default.rtol),
        atol: number(&section.atol).unwrap_or(default.atol),
        step: number(&section.step),
    }
}

pub(super) fn effect(section: &EffectSection) -> EffectDef {
    let parameter = |p: &crate::file::EffectParameterSection| EffectParameter {
        name: p.name.get_ref().clone(),
        unit: p.unit.clone(),
        range: p.range.unwrap_or(EffectParameter::default().range),
        grid: p.grid.clone(),
        is_rounding: p.rounds,
        ..EffectParameter::default()
    };
    let state = |s: &StateSection| EffectState {
        name: s.name.get_ref().clone(),
        unit: s.unit.clone(),
        initial: s.initial.get_ref().clone(),
        rate: s.rate.iter().map(|(_, term)| format!("({})", term.get_ref())).collect::<Vec<_>>().join(" + "),
    };
    let add = |(to, term): &(Spanned<String>, Spanned<String>)| Addition {
        to: to.get_ref().clone(),
        term: term.get_ref().clone(),
    };
    EffectDef {
        name: section.name.get_ref().clone(),
        says: section.says.clone(),
        adds: section.adds.iter().map(add).collect(),
        parameters: section.parameters.iter().map(parameter).collect(),
        states: section.states.iter().map(state).collect(),
        confounders: section.confounders.clone(),
        source: section.source.clone(),
        built_in: section.built_in.as_ref().map(|b| b.get_ref().clone()),
    }
}
