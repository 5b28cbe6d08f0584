//! From a refusal of the model to the place in the study file that caused it.
//!
//! The model's errors hold names and expressions, not places: names are looked up among the names that the file gives,
//! expressions among its expressions. Next file to read: [`crate::problem`].

use std::ops::Range;

use starlings_models::equations::Expression;
use starlings_models::{SetupError, did_you_mean, nearest};
use toml::Spanned;

use crate::expand::INITIAL;
use crate::file::StudyFile;
use crate::file::locate::character;
use crate::problem::Source;

/// Every expression of the file, in its order.
pub(crate) fn expressions(file: &StudyFile) -> Vec<&Spanned<String>> {
    let model = file.model.equations.iter();
    let outputs = model.clone().flat_map(|e| &e.outputs).map(|o| &o.value);
    let states = model.flat_map(|e| &e.states).chain(file.effects.iter().flat_map(|e| &e.states));
    let of_states =
        states.flat_map(|s| s.rate.iter().chain(&s.noise).map(|(_, term)| term).chain([&s.initial]));
    let terms = file.effects.iter().flat_map(|e| &e.adds).map(|(_, term)| term);
    outputs.chain(of_states).chain(terms).filter(|e| !e.get_ref().is_empty()).collect()
}

/// Every name of the file, in the order in which a wrong one is most likely meant.
fn names(file: &StudyFile) -> Vec<&Spanned<String>> {
    let equations = || file.model.equations.iter();
    let mut names: Vec<&Spanned<String>> = vec![&file.model.kind];
    names.extend(file.parameters.iter().map(|p| &p.name));
    names.extend(file.model.constants.iter().map(|(name, _)| name));
    names.extend(equations().flat_map(|e| &e.replaceable));
    names.extend(file.effects.iter().filter_map(|e| e.built_in.as_ref()));
    names.extend(file.effects.iter().flat_map(|e| &e.adds).map(|(to, _)| to));
    names.extend(file.observer.all().flat_map(|o| &o.corrects).flat_map(|(output, state)| [output, state]));
    names.extend(file.effects.iter().map(|e| &e.name));
    names.extend(file.effects.iter().flat_map(|e| &e.parameters).map(|p| &p.name));
    names.extend(file.effects.iter().flat_map(|e| &e.states).map(|s| &s.name));
    names.extend(equations().flat_map(|e| e.outputs.iter().chain(&e.inputs)).map(|q| &q.name));
    names.extend(equations().flat_map(|e| &e.states).map(|s| &s.name));
    names
}

/// Reports what the model refused.
pub(crate) fn blame(source: &Source, file: &StudyFile, error: &SetupError) {
    match error {
        SetupError::Unknown { what, name, nearest } => {
            let span = place(file, name).unwrap_or_else(|| file.model.kind.span());
            let message = format!("no {what} is named `{name}`");
            match nearest {
                Some(near) => source.report_with(span, message, did_you_mean(near)),
                None if *what == "model" => {
                    source.report_with(span, message, "`starlings models` lists them");
                }
                None => source.report(span, message),
            }
        }
        SetupError::Missing { model, name } => report_missing(source, file, model, name),
        SetupError::Twice(name) => {
            let second = names(file)
                .into_iter()
                .filter(|n| n.get_ref() == name)
                .map(Spanned::span)
                .max_by_key(|s| s.start);
            let span = second.unwrap_or_else(|| file.model.kind.span());
            source.report_with(
                span,
                format!("the name `{name}` is given twice"),
                "names are unique in a study",
            );
        }
        SetupError::Expression { place, expression, column, message } => {
            let of_initial = place.starts_with("initial");
            let initials: Vec<Range<usize>> =
                file.model.equations.iter().flat_map(|e| &e.states).map(|s| s.initial.span()).collect();
            let same: Vec<&Spanned<String>> =
                expressions(file).into_iter().filter(|e| e.get_ref() == expression).collect();
            let text = same.iter().find(|e| initials.contains(&e.span()) == of_initial).or(same.first());
            let span = text.map_or(file.model.kind.span(), |e| character(&source.text, &e.span(), *column));
            source.report(span, format!("{place}: {message}"));
        }
        SetupError::Layout { path, message } => {
            let place = file.model.layout.as_ref().and_then(|layout| layout.place(path));
            source.report(place.unwrap_or_else(|| file.model.kind.span()), format!("layout: {message}"));
        }
        SetupError::Invalid(message) => {
            let mut quoted = message.split('`').skip(1).step_by(2);
            let named = quoted.find_map(|name| place(file, name));
            let observer = message.contains("observer").then(|| file.observer.kind.span());
            source.report(observer.or(named).unwrap_or_else(|| file.model.kind.span()), message.clone());
        }
    }
}

/// Where the file gives a name.
fn place(file: &StudyFile, name: &str) -> Option<Range<usize>> {
    let found = |n: &&Spanned<String>| n.get_ref() == name || n.get_ref().strip_prefix(INITIAL) == Some(name);
    names(file).into_iter().find(found).map(Spanned::span)
}

/// Reports a parameter without a value: where an expression first uses it, or else at the model.
pub(crate) fn report_missing(source: &Source, file: &StudyFile, model: &str, name: &str) {
    let used = expressions(file).into_iter().find_map(|text| {
        let names = Expression::parse(text.get_ref()).ok()?.names();
        let (_, column) = names.into_iter().find(|(n, _)| n == name)?;
        let start = character(&source.text, &text.span(), column).start;
        Some(start..character(&source.text, &text.span(), column + name.chars().count() - 1).end)
    });
    let known: Vec<String> = names(file).into_iter().skip(1).map(|n| n.get_ref().clone()).collect();
    let near = nearest(name, &known);
    let help = match near.filter(|_| used.is_some()) {
        Some(near) => {
            format!("{} Otherwise give it a value in `constants` or as `[[parameters]]`", did_you_mean(near))
        }
        None => "give it a value in `constants`, or add it as `[[parameters]]`".to_owned(),
    };
    let message = format!("parameter `{name}` of model `{model}` has no value");
    source.report_with(used.unwrap_or_else(|| file.model.kind.span()), message, help);
}
