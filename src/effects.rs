//! `starlings effects`: the built-in effects, or those that would be tried for a study.

use std::path::PathBuf;

use clap::Parser;
use serde_json::{Value, json};
use starlings_coordinator::explain::{Options, candidates};
use starlings_coordinator::study::Study;
use starlings_models::EffectDef;
use starlings_models::effect::library::{FAMILIES, Family, stem};

use crate::console::{fitted, line, text};
use crate::failure::Failure;
use crate::load::load;

/// List the effects that a search for what a model lacks can try: all built-in ones, or those with a place in a study.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file; the whole catalogue is listed without it.
    study: Option<PathBuf>,
    /// Print the list as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// An effect and where it comes from: a family of the library, or the study.
struct Entry {
    origin: &'static str,
    effect: EffectDef,
}

/// Prints the catalogue, or what would be tried for a study.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let entries = match &args.study {
        Some(path) => of_study(&load(path)?)?,
        None => catalogue(),
    };
    if args.json {
        return line(format_args!("{:#}", entries.iter().map(as_json).collect::<Value>()));
    }
    match &args.study {
        Some(_) => print_study(&entries),
        None => print_catalogue(&entries),
    }
}

/// Every kind of built-in effect, named without a place.
fn catalogue() -> Vec<Entry> {
    let of = |family: &'static Family| {
        family.catalogue().into_iter().map(|effect| Entry { origin: family.name, effect })
    };
    FAMILIES.iter().flat_map(of).collect()
}

/// What `starlings explain` would try.
fn of_study(study: &Study) -> Result<Vec<Entry>, Failure> {
    let tried = candidates(study, &Options::of(study)).map_err(Failure::input)?;
    let catalogue = catalogue();
    let origin = |effect: &EffectDef| {
        let own = study.candidates.iter().any(|candidate| candidate.name == effect.name);
        let known = || catalogue.iter().find(|entry| entry.effect.name == stem(&effect.name));
        if own { "study" } else { known().map_or("built-in", |entry| entry.origin) }
    };
    Ok(tried.into_iter().map(|effect| Entry { origin: origin(&effect), effect }).collect())
}

fn as_json(entry: &Entry) -> Value {
    let mut value = json!({ "family": entry.origin });
    if let (Some(map), Ok(Value::Object(effect))) =
        (value.as_object_mut(), serde_json::to_value(&entry.effect))
    {
        map.extend(effect);
    }
    value
}

fn print_catalogue(entries: &[Entry]) -> Result<(), Failure> {
    for family in FAMILIES {
        line(format_args!("{}\n  {}\n", family.title(), family.needs))?;
        let mut rows = vec![["effect", "what it says", "source"].map(str::to_owned).to_vec()];
        for Entry { effect, .. } in entries.iter().filter(|entry| entry.origin == family.name) {
            rows.push(vec![effect.name.clone(), effect.says.clone(), effect.source.clone()]);
        }
        text(fitted(&rows))?;
        line("")?;
        parameters(entries.iter().filter(|entry| entry.origin == family.name))?;
        line("")?;
    }
    line("`starlings effects STUDY` lists those with a place in a study, and where each enters.")
}

fn print_study(entries: &[Entry]) -> Result<(), Failure> {
    line(format_args!("{} effects would be tried.\n", entries.len()))?;
    let mut rows = vec![["effect", "from", "enters", "term", "what it says"].map(str::to_owned).to_vec()];
    for Entry { origin, effect } in entries {
        for (i, add) in effect.adds.iter().enumerate() {
            let once = |text: &str| if i == 0 { text.to_owned() } else { String::new() };
            let (name, origin, says) = (once(&effect.name), once(origin), once(&effect.says));
            rows.push(vec![name, origin, add.to.clone(), add.term.clone(), says]);
        }
    }
    text(fitted(&rows))?;
    line("")?;
    parameters(entries.iter())
}

fn parameters<'a>(entries: impl Iterator<Item = &'a Entry>) -> Result<(), Failure> {
    let mut rows = vec![["effect", "parameter", "unit", "range", "meaning"].map(str::to_owned).to_vec()];
    for Entry { effect, .. } in entries {
        for (i, p) in effect.parameters.iter().enumerate() {
            let name = if i == 0 { effect.name.clone() } else { String::new() };
            rows.push(vec![name, p.name.clone(), p.unit.clone(), p.range_text(), p.says.clone()]);
        }
    }
    text(fitted(&rows))
}
