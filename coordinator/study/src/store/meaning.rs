//! Digests of everything that decides the numbers of a run, part by part: a resumed run must find every part unchanged.
//!
//! The parts are those of the checked study, not of its text: comments, layout, patience and the fleet are in none of them, the
//! recordings are. The programs that run the model are in [`super::program`]. Next file to read: [`super::changes`], which says
//! in the words of the study file what differs.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;

use serde::{Deserialize, Serialize};
use starlings_models::SolverDef;

use super::Purpose;
use super::json::json;
use crate::expand::INITIAL;
use crate::{Record, Study, run_key};

/// A part of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// Anything that stands in the study file.
    StudyFile,
    /// Numbers of recordings and of initial values.
    Recordings,
    /// The description of a solver, and the files that go to it.
    Solver,
}

/// A digest per part, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Meaning(BTreeMap<String, String>);

/// Before the name of a record.
const RECORD: &str = "record ";
const SOLVER: &str = "solver";
const START: &str = "initial values";

impl Meaning {
    /// Name under which the store keeps it.
    pub(super) const KEY: &'static str = "meaning";

    /// Everything in a study that the numbers of a command depend on.
    pub(super) fn of(study: &Study, purpose: Purpose) -> Self {
        let mut setup = study.setup.clone();
        // Initial values may come from a file.
        setup.model.constants.retain(|name, _| !name.starts_with(INITIAL));
        setup.model.solver = setup.model.solver.as_deref().map(|solver| Box::new(asked(solver)));
        let mut parts = BTreeMap::from([
            ("model".to_owned(), digest(&json(&setup))),
            ("parameters".to_owned(), written(&(&study.parameters, &study.theta))),
            ("estimator".to_owned(), written(&(study.seed, &study.estimator))),
            (START.to_owned(), start(study)),
            (SOLVER.to_owned(), solver(study)),
        ]);
        if purpose == Purpose::Run && !study.predict.outputs.is_empty() {
            parts.insert("predict".to_owned(), written(&study.predict));
        }
        if purpose == Purpose::Explanation {
            parts.insert("explain".to_owned(), written(&(&study.explain, &study.candidates)));
        }
        parts.extend(study.records.iter().flat_map(|record| {
            let settings = (&record.train, record.every, channels(record));
            [(format!("settings of {}", record.name), written(&settings)), (named(record), numbers(record))]
        }));
        Self(parts)
    }

    /// The parts that another study has otherwise, and the records whose numbers are others.
    pub(super) fn differences(&self, other: &Self) -> (BTreeSet<Part>, Vec<String>) {
        let names: BTreeSet<&String> = self.0.keys().chain(other.0.keys()).collect();
        let differing: Vec<&String> =
            names.into_iter().filter(|name| self.0.get(*name) != other.0.get(*name)).collect();
        let part = |name: &&String| match name.as_str() {
            SOLVER => Part::Solver,
            START => Part::Recordings,
            name if name.starts_with(RECORD) => Part::Recordings,
            _ => Part::StudyFile,
        };
        let records = differing.iter().filter_map(|name| name.strip_prefix(RECORD)).map(str::to_owned);
        (differing.iter().map(part).collect(), records.collect())
    }
}

fn named(record: &Record) -> String {
    format!("{RECORD}{}", record.name)
}

/// What decides the answers of a solver, without its place and its resources.
fn asked(solver: &SolverDef) -> SolverDef {
    SolverDef {
        adapter: solver.adapter.clone(),
        timeout: solver.timeout,
        model: solver.model.clone(),
        ..SolverDef::default()
    }
}

/// What a record's channels are, without their values.
fn channels(record: &Record) -> Vec<impl Debug + '_> {
    record.channels.iter().map(|c| (&c.output, c.row, c.noise.to_bits(), c.held_out)).collect()
}

/// Every number of a record.
fn numbers(record: &Record) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut feed = |values: &[f64]| run_key::numbers(&mut hasher, values);
    feed(&record.times);
    for channel in &record.channels {
        feed(&channel.values);
        if let Some(node) = &channel.node {
            feed(&[node.rest, node.normal].concat());
            feed(&node.seen.numbers);
        }
    }
    for input in &record.inputs {
        feed(&input.times);
        feed(&input.values);
    }
    hasher.finalize().to_hex().to_string()
}

/// Initial values that are not estimated.
fn start(study: &Study) -> String {
    let values = study.setup.model.constants.range(INITIAL.to_owned()..);
    let values = values.filter(|(name, _)| name.starts_with(INITIAL));
    written(&values.map(|(name, value)| (name, value.to_bits())).collect::<Vec<_>>())
}

/// The description of a solver and the files that go to it, templates and copies.
fn solver(study: &Study) -> String {
    let Some(solver) = &study.setup.model.solver else { return String::new() };
    let mut hasher = blake3::Hasher::new();
    hasher.update(json(&solver.described).as_bytes());
    if let Some(files) = &solver.files {
        hasher.update(json(&(&files.templates, &files.reads)).as_bytes());
        for (name, path) in &files.copies {
            hasher.update(name.as_bytes());
            // A copy that cannot be read now is reported by the run that needs it.
            hasher.update(&std::fs::read(path).unwrap_or_default());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// A digest of plain data; every digit of a number is in its debug text.
fn written(value: &impl Debug) -> String {
    digest(&format!("{value:?}"))
}

fn digest(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}
