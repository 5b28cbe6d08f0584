//! The model of a study: definitions from what is written, built to see whether they fit together.
//!
//! What the model refuses is reported at the place in the file that caused it: see [`super::blame`]. Next file to read:
//! [`super::parameters`].

use std::collections::BTreeMap;

use starlings_models::effect::library::write_out;
use starlings_models::equations::Expression;
use starlings_models::{BuildSetup, EffectDef, ModelDef, Role, Setup, Spec};

use super::blame::{blame, expressions, report_missing};
use super::built::{CheckedModel, quantity, valid_names};
use super::defs::{effect, equations};
use super::limits;
use super::relative;
use super::solver::{DescribedSolver, fits};
use crate::expand::INITIAL;
use crate::file::locate::character;
use crate::file::{EffectSection, StudyFile};
use crate::problem::Source;
use crate::variant::{has_delay, reads_past};

/// Builds the model of a study; `None` when a problem was reported.
pub(crate) fn model(
    source: &Source,
    file: &StudyFile,
    solver: Option<&DescribedSolver>,
) -> Option<CheckedModel> {
    let before = source.count();
    check_expressions(source, file);
    if file.model.solver.is_some() && solver.is_none() {
        return None;
    }
    let constants: BTreeMap<String, f64> =
        file.model.constants.iter().map(|(name, value)| (name.get_ref().clone(), *value.get_ref())).collect();
    let equations = file.model.equations.as_ref().map(|section| equations(source, section));
    if source.count() > before {
        return None;
    }
    let layout = file.model.layout.as_ref().map(|layout| layout.value.clone());
    let solver = solver.map(|known| Box::new(known.def.clone()));
    let model = ModelDef { kind: file.model.kind.get_ref().clone(), constants, equations, layout, solver };
    let (max_steps, timeout) = (limits::max_steps(source, file), limits::timeout(source, file));
    let mut setup = Setup { model, max_steps, timeout, ..Setup::default() };
    let bare = spec(source, file, &setup)?;
    check_roles(source, file, &bare);
    let candidates = sort_effects(source, file, &mut setup, &bare)?;
    let mut spec = spec(source, file, &setup)?;
    relative::open(&mut spec, &setup.effects);
    let mut valid_names = valid_names(&spec);
    valid_names.extend(candidates.iter().flat_map(|e| &e.parameters).map(|p| p.name.clone()));
    let delays = expressions(file).iter().any(|e| reads_past(e.get_ref()))
        || setup.effects.iter().any(has_delay) // a built-in one has its terms in the library, not in the file
        || spec.parameters.iter().any(|q| q.role == Role::Shift);
    Some(CheckedModel { setup, spec, candidates, valid_names, delays })
}

pub(super) fn spec(source: &Source, file: &StudyFile, setup: &Setup) -> Option<Spec> {
    setup.model().map(|model| model.spec().clone()).map_err(|error| blame(source, file, &error)).ok()
}

/// Puts every effect that has a value for one of its parameters into the setup and returns the others.
fn sort_effects(source: &Source, file: &StudyFile, setup: &mut Setup, bare: &Spec) -> Option<Vec<EffectDef>> {
    let before = source.count();
    let given = |name: &String| {
        file.parameters.iter().any(|p| p.name.get_ref() == name)
            || file.model.constants.iter().any(|(constant, _)| constant.get_ref() == name)
    };
    let mut candidates: Vec<EffectDef> = Vec::new();
    for section in &file.effects {
        let told = source.count();
        refuse_fields(source, section, bare);
        if source.count() > told {
            continue;
        }
        let name = section.name.get_ref();
        if setup.effects.iter().chain(&candidates).any(|e| e.name == *name) {
            source.report_with(
                section.name.span(),
                format!("two effects are named `{name}`"),
                "names are unique in a study",
            );
        }
        match write_out(&effect(section), bare, &file.study.time_unit) {
            Ok(written) if written.parameters.iter().any(|p| given(&p.name)) => setup.effects.push(written),
            Ok(written) => candidates.push(written),
            Err(error) => blame(source, file, &error),
        }
    }
    // A candidate must build too, or the search for a missing effect would fail late.
    for candidate in candidates.iter().filter(|_| source.count() == before) {
        let mut effects = needed(candidate, &setup.effects, &candidates);
        effects.push(candidate.clone());
        spec(source, file, &Setup { effects, ..setup.clone() });
    }
    (source.count() == before).then_some(candidates)
}

/// The effects beside which a candidate is tried: those that take part, and candidates whose states it adds to or reads.
fn needed(candidate: &EffectDef, present: &[EffectDef], candidates: &[EffectDef]) -> Vec<EffectDef> {
    let terms = candidate.adds.iter().map(|add| &add.term).chain(candidate.states.iter().map(|s| &s.rate));
    let read = terms.filter_map(|term| Expression::parse(term).ok()).flat_map(|term| term.names());
    let mut names: Vec<String> = read.map(|(name, _)| name).collect();
    names.extend(candidate.adds.iter().map(|add| add.to.clone()));
    let is_read = |effect: &&EffectDef| {
        effect.name != candidate.name && effect.states.iter().any(|state| names.contains(&state.name))
    };
    present.iter().chain(candidates.iter().filter(is_read)).cloned().collect()
}

/// Terms are scalar: a field in a term is reported here, before its name is looked up.
fn refuse_fields(source: &Source, section: &EffectSection, bare: &Spec) {
    let fields: Vec<_> = bare.states.iter().chain(&bare.outputs).filter(|q| q.size > 1).collect();
    for (_, term) in &section.adds {
        let names = Expression::parse(term.get_ref()).map(|e| e.names()).unwrap_or_default();
        for (name, column) in names {
            let own = section.parameters.iter().any(|p| *p.name.get_ref() == name);
            if let Some(field) = fields.iter().find(|q| q.name == name && !own) {
                let message = format!("`{name}` has {} components, and a term is one number", field.size);
                let help =
                    format!("effects of model `{}` can use its scalar quantities and parameters", bare.kind);
                source.report_with(character(&source.text, &term.span(), column), message, help);
            }
        }
    }
}

/// Parses every expression, so that each syntax error is reported and not only the first.
fn check_expressions(source: &Source, file: &StudyFile) {
    for text in expressions(file) {
        if let Err(error) = Expression::parse(text.get_ref()) {
            source.report(character(&source.text, &text.span(), error.column), error.message);
        }
    }
}

/// A meaning is given to parameters that the equations use.
fn check_roles(source: &Source, file: &StudyFile, bare: &Spec) {
    let known: Vec<String> = bare.parameters.iter().map(|q| q.name.clone()).collect();
    for (name, _) in file.model.equations.iter().flat_map(|section| &section.roles) {
        if !known.contains(name.get_ref()) {
            let message = format!("the equations have no parameter `{}`", name.get_ref());
            source.report_unknown(name.span(), message, &known);
        }
    }
}

/// Constants must be known and possible, and every parameter must have a value, of those names that `which` tells.
pub(crate) fn check_values(
    source: &Source,
    file: &StudyFile,
    model: &CheckedModel,
    which: &dyn Fn(&str) -> bool,
) {
    let spec = &model.spec;
    let in_terms: Vec<String> = file
        .effects
        .iter()
        .flat_map(|e| &e.adds)
        .filter_map(|(_, term)| Expression::parse(term.get_ref()).ok())
        .flat_map(|e| e.names())
        .map(|(name, _)| name)
        .collect();
    for (name, value) in file.model.constants.iter().filter(|(name, _)| which(name.get_ref())) {
        match quantity(spec, name.get_ref()) {
            Some(q) if *value.get_ref() < q.range[0] || *value.get_ref() > q.range[1] => {
                let (name, range) = (name.get_ref(), q.range_text());
                let message =
                    format!("constant `{name}` is {}, outside the model's range ({range})", value.get_ref());
                source.report(value.span(), message);
            }
            None if !in_terms.contains(name.get_ref()) => {
                let message = format!("model `{}` has no parameter `{}`", spec.kind, name.get_ref());
                source.report_unknown(name.span(), message, &model.valid_names);
            }
            _ => {}
        }
    }
    for q in spec.parameters.iter().filter(|q| q.default.is_none() && which(&q.name)) {
        let constant = file.model.constants.iter().any(|(name, _)| *name.get_ref() == q.name);
        if !constant && !file.parameters.iter().any(|p| *p.name.get_ref() == q.name) {
            report_missing(source, file, &spec.kind, &q.name);
        }
    }
    let initial =
        |name: &str| name.strip_prefix(INITIAL).and_then(|s| spec.states.iter().find(|q| q.name == s));
    for p in file.parameters.iter().filter(|p| which(p.name.get_ref())) {
        if let Some(q) = initial(p.name.get_ref()).filter(|q| q.size != 1) {
            let message = format!("state `{}` has {} components: a parameter is one value", q.name, q.size);
            let help = format!("name one, such as `{INITIAL}{}[0]`", q.name);
            source.report_with(p.name.span(), message, help);
        }
    }
}

/// Builds the setup as workers will; of a solver everything but the program.
pub(crate) fn check_build(source: &Source, file: &StudyFile, setup: &Setup) {
    let built = match setup.model.description() {
        Some(description) => fits(setup, description),
        None => setup.build().map(|_| ()),
    };
    if let Err(error) = built {
        blame(source, file, &error);
    }
}
