//! The reduced model of an inference: its expressions parse and use names that are there.
//!
//! Whether the names of its coefficients exist is known once the question is put together. Next file to read:
//! [`crate::infer_choice`].

use starlings_models::equations::Expression;
use starlings_models::{did_you_mean, nearest};
use toml::Spanned;

use crate::file::infer::ReducedSection;
use crate::file::locate::character;
use crate::infer_choice::ReducedChoice;
use crate::problem::Source;

/// `[infer.reduced]`.
pub(super) fn reduced(source: &Source, section: &ReducedSection) -> ReducedChoice {
    if section.start.is_empty() {
        source.report(section.span.clone(), "`start` names no unknown of the reduced model");
    }
    let mut known: Vec<String> = section.start.iter().map(|(name, _)| name.get_ref().clone()).collect();
    for (name, text) in &section.define {
        check(source, text, &known);
        known.push(name.get_ref().clone());
    }
    for (_, text) in &section.coefficients {
        check(source, text, &known);
    }
    let plain = |list: &[(Spanned<String>, Spanned<String>)]| {
        list.iter().map(|(name, text)| (name.get_ref().clone(), text.get_ref().clone())).collect()
    };
    ReducedChoice {
        start: section.start.iter().map(|(name, value)| (name.get_ref().clone(), *value.get_ref())).collect(),
        define: plain(&section.define),
        coefficients: plain(&section.coefficients),
    }
}

/// Reports an expression that does not parse, or a name that is not known there.
fn check(source: &Source, text: &Spanned<String>, known: &[String]) {
    match Expression::parse(text.get_ref()) {
        Err(error) => {
            source.report(character(&source.text, &text.span(), error.column), error.message);
        }
        Ok(expression) => {
            for (name, column) in expression.names().into_iter().filter(|(name, _)| !known.contains(name)) {
                let span = character(&source.text, &text.span(), column);
                let message = format!("the reduced model has no unknown `{name}`");
                let near = nearest(&name, known).map(did_you_mean);
                source.report_with(
                    span,
                    message,
                    near.unwrap_or_else(|| format!("known here: {}", known.join(", "))),
                );
            }
        }
    }
}
