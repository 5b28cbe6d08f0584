//! From TOML text to a [`StudyFile`]: sections, parameters and records.
//!
//! Every fault of form (a missing or unknown key, a wrong type) is reported to the [`Source`]; reading goes on so that one call
//! reports them all. Next file to read: [`super::model`] for the model and the effects.

use starlings_proto::adapters::AdapterDef;
use toml::Spanned;
use toml::de::DeTable;

use super::channels::{channels, held_out};
use super::model::{effects, model};
use super::settings::{estimator, explain, fleet};
use super::table::{Table, named_texts};
use super::{
    ObserverSection, ParameterSection, PriorSection, ProcessSection, RecordSection, StudyFile, StudySection,
};
use crate::problem::{Source, StudyError};

const SECTIONS: [&str; 13] = [
    "study",
    "model",
    "parameters",
    "observer",
    "records",
    "effects",
    "explain",
    "spectrum",
    "predict",
    "infer",
    "diagnose",
    "estimator",
    "fleet",
];

/// Reads the text of a study file, in which a solver is reached by one of the adapters; faults of form are reported to the
/// source.
///
/// # Errors
/// Where the text is no TOML, or has a table in the place of a list.
pub(crate) fn read(source: &Source, adapters: &[AdapterDef]) -> Result<StudyFile, StudyError> {
    let (root, faults) = DeTable::parse_recoverable(&source.text);
    if super::brackets::report(source, root.get_ref(), !faults.is_empty()) {
        source.verdict()?;
    }
    for fault in &faults {
        let end = source.text.len();
        source.report(fault.span().unwrap_or(end..end), format!("this is not TOML: {}", fault.message()));
    }
    source.verdict()?;
    let root = Table::from_map(source, root.get_ref(), 0..0, "the study", &SECTIONS);
    let file = StudyFile {
        study: study(&root),
        model: model(source, &root, adapters),
        parameters: parameters(&root),
        observer: observer(source, &root),
        records: records(source, &root),
        effects: effects(source, &root),
        explain: explain(&root),
        spectrum: super::spectrum::read(&root),
        predict: super::predict::read(&root),
        infer: super::infer::read(source, &root),
        diagnose: super::diagnose::read(source, &root),
        needs_parameter: true,
        estimator: estimator(&root),
        fleet: fleet(&root),
    };
    Ok(file)
}

fn study(root: &Table<'_>) -> StudySection {
    let section = root.table("study", "[study]", &["name", "seed", "time_unit", "says"]);
    if root.get("study").is_none() {
        root.missing("study", "a section `[study]` with a `name`");
    }
    let Some(t) = section else {
        let name = Spanned::new(0..0, String::new());
        return StudySection { name, says: String::new(), seed: 1, time_unit: "s".to_owned() };
    };
    StudySection {
        name: t.required_text("name", "a name for the run's folder and report"),
        says: t.text("says").map(Spanned::into_inner).unwrap_or_default(),
        seed: t.count("seed").map_or(1, Spanned::into_inner),
        time_unit: t.text("time_unit").map_or_else(|| "s".to_owned(), Spanned::into_inner),
    }
}

/// `[[parameters]]` of the study, or of a table of it.
pub(super) fn parameters(root: &Table<'_>) -> Vec<ParameterSection> {
    let keys = ["name", "unit", "prior", "process", "per_record"];
    let read = |t: Table<'_>| {
        if t.get("prior").is_none() {
            t.missing("prior", "such as `prior = { transform = \"log\", median = 1.0, factor = 2.0 }`");
        }
        ParameterSection {
            name: t.required_text("name", "a model parameter, or \"initial:<state>\""),
            unit: t.text("unit"),
            prior: prior(&t),
            process: process(&t),
            per_record: t.flag("per_record").map(Spanned::into_inner),
        }
    };
    root.tables("parameters", "[[parameters]]", &keys).into_iter().map(read).collect()
}

fn prior(parameter: &Table<'_>) -> PriorSection {
    let keys = ["transform", "median", "mean", "median_from", "factor", "sd", "lo", "hi"];
    let Some(t) = parameter.table("prior", "`prior`", &keys) else { return PriorSection::default() };
    PriorSection {
        span: t.span.clone(),
        transform: t.text("transform"),
        median: t.number("median"),
        mean: t.number("mean"),
        median_from: t.text("median_from"),
        factor: t.number("factor"),
        sd: t.number("sd"),
        lo: t.number("lo"),
        hi: t.number("hi"),
    }
}

fn process(parameter: &Table<'_>) -> ProcessSection {
    let Some(t) = parameter.table("process", "`process`", &["forgetting", "walk"]) else {
        return ProcessSection::default();
    };
    ProcessSection { forgetting: t.number("forgetting"), walk: t.number("walk") }
}

/// `[observer]`, or a list `[[observer]]`.
fn observer(source: &Source, root: &Table<'_>) -> ObserverSection {
    let keys = ["kind", "gain", "corrects"];
    let is_list = root.get("observer").is_some_and(|node| node.get_ref().as_array().is_some());
    let tables: Vec<Table<'_>> = if is_list {
        root.tables("observer", "[[observer]]", &keys)
    } else {
        root.table("observer", "[observer]", &keys).into_iter().collect()
    };
    let mut sections = tables.iter().map(|t| ObserverSection {
        kind: t.text("kind").unwrap_or_else(|| Spanned::new(t.span.clone(), "none".to_owned())),
        gain: t.number("gain").unwrap_or_else(|| Spanned::new(t.span.clone(), 0.0)),
        corrects: named_texts(source, &t.free_entries("corrects")),
        beside: Vec::new(),
    });
    let Some(first) = sections.next() else {
        let (kind, gain) = (Spanned::new(0..0, "none".to_owned()), Spanned::new(0..0, 0.0));
        return ObserverSection { kind, gain, corrects: Vec::new(), beside: Vec::new() };
    };
    let beside = sections.collect();
    ObserverSection { beside, ..first }
}

fn records(source: &Source, root: &Table<'_>) -> Vec<RecordSection> {
    let keys = [
        "name",
        "file",
        "time",
        "inputs",
        "channels",
        "start",
        "period",
        "train",
        "use",
        "start_rows",
        "every",
    ];
    let mut records = Vec::new();
    for t in root.tables("records", "[[records]]", &keys) {
        if t.get("channels").is_none() {
            t.missing(
                "channels",
                "such as `[ { column = \"pressure\", output = \"pressure\", noise = 2.0 } ]`",
            );
        }
        records.push(RecordSection {
            span: t.span.clone(),
            name: t.required_text("name", "a name for the recording"),
            file: t.required_text("file", "a CSV file, relative to the study"),
            time: t.text("time").unwrap_or_else(|| Spanned::new(t.span.clone(), "time".to_owned())),
            inputs: named_texts(source, &t.free_entries("inputs")),
            channels: channels(source, &t, root.get("infer").is_some()),
            start: t.number("start"),
            period: t.number("period"),
            train: t.interval("train"),
            held_out: held_out(source, &t),
            start_rows: t.count("start_rows"),
            every: t.count("every").unwrap_or_else(|| Spanned::new(t.span.clone(), 1)),
        });
    }
    records
}
