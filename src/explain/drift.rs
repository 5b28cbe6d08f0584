//! `starlings explain` of stochastic equations: which term their drift lacks, scored by the sums of an inference.
//!
//! The search is that of `starlings infer` with `[infer.candidates]`; what is written beside its files is the explanation and the study with the
//! term in it. Next file to read: [`crate::infer`].

use std::path::Path;

use starlings_coordinator::explain::{DriftTerm, explained_drift};
use starlings_coordinator::infer::explained::{DriftExplanation, explained};
use starlings_coordinator::study::Study;

use super::Args;
use crate::console::{line, note};
use crate::failure::Failure;
use crate::fleet_session::finish;
use crate::infer::{Made, make, print};
use crate::interrupt;
use crate::progress::Display;

/// Explains what a drift lacks, and writes the folder.
pub(super) fn run(args: &Args) -> Result<(), Failure> {
    interrupt::watch();
    refuse(args)?;
    let study = Study::load_for_inference(&args.study)?;
    if study.infer.as_ref().is_none_or(|choice| choice.missing.is_none()) {
        return Err(Failure::input(format!(
            "{}: `explain` of a study with `[infer]` scores terms that its drift may lack, and none is listed: add `[infer.candidates]` with \
             `degree = 2` or `functions = [...]`",
            args.study.display()
        )));
    }
    let display = Display::new(args.json);
    let made = make(&study, "explain", (&args.fleet, args.out.as_deref()), &display)?;
    let told = tell(&study, &made, args.json);
    finish(made.page, Some(&made.folder.join("report.html")));
    told
}

/// Writes the explanation beside the inference, and says it.
fn tell(study: &Study, made: &Made, json: bool) -> Result<(), Failure> {
    let Some(mut explanation) = explained(&made.found) else {
        return Err(Failure::run("the inference looked for no term".to_owned()));
    };
    write_explained(study, &mut explanation, &made.folder)?;
    let text = serde_json::to_string_pretty(&explanation).map_err(Failure::run)?;
    write(&made.folder.join("explain.json"), &(text.clone() + "\n"))?;
    if json {
        return line(text);
    }
    print::print(&made.found, &made.folder)?;
    if explanation.explained_study.is_some() {
        note(format_args!("the study with what was named: {}", made.folder.join("explained.toml").display()));
    }
    Ok(())
}

/// What the search of effects knows and this one does not.
fn refuse(args: &Args) -> Result<(), Failure> {
    let given = [
        ("--without", !args.without.is_empty()),
        ("--only", !args.only.is_empty()),
        ("--null", args.nulls > 0),
        ("--budget", args.budget.is_some()),
        ("--max-effects", args.max_effects.is_some()),
        ("--force", args.force),
        ("--resume", !args.resume.is_first()),
    ];
    match given.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((option, _)) => Err(Failure::input(format!(
            "{option} belongs to the search of effects in a deterministic model; this study has `[infer]`, whose `[infer.candidates]` lists \
             the terms that are tried: leave the option out"
        ))),
    }
}

/// Writes the study with the named terms, where there are any.
fn write_explained(study: &Study, explanation: &mut DriftExplanation, folder: &Path) -> Result<(), Failure> {
    let terms = explanation.effects.iter().map(|effect| {
        let [addition] = &effect.adds;
        DriftTerm { equation: addition.to.clone(), function: addition.term.clone() }
    });
    let terms: Vec<DriftTerm> = terms.collect();
    if terms.is_empty() {
        return Ok(());
    }
    match explained_drift(study, &terms, folder) {
        Ok((text, names)) => {
            write(&folder.join("explained.toml"), &text)?;
            explanation.explained_study = Some("explained.toml".to_owned());
            for (effect, name) in explanation.effects.iter_mut().zip(names) {
                effect.parameters[0].name = name;
            }
        }
        Err(error) => explanation.warnings.push(format!("no explained study was written: {error}")),
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .map_err(|error| Failure::run(format!("cannot write {}: {error}", path.display())))
}
