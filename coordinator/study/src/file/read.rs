//! From TOML text to a [`StudyFile`]: sections, parameters and records.
//!
//! Every fault of form (a missing or unknown key, a wrong type) is reported to the [`Source`]; reading goes on so that one call
//! reports them all. Next file to read: [`super::model`] for the model and the effects.

use starlings_proto::adapters::AdapterDef;
use toml::Spanned;
use toml::de::DeTable;

use super::model::{effects, model};
use super::settings::{estimator, explain, fleet};
use super::table::{Node, Table, named_texts, number, wrong_type};
use super::{
    ChannelSection, ObserverSection, ParameterSection, PriorSection, ProcessSection, RecordSection,
    StudyFile, StudySection, SurfaceSection,
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

/// Whether a record, or a channel, is to be left out of every fit.
fn held_out(source: &Source, of: &Table<'_>) -> bool {
    match of.text("use") {
        None => false,
        Some(text) if text.get_ref() == "held-out" => true,
        Some(text) if text.get_ref() == "train" => false,
        Some(text) => {
            let valid = ["train".to_owned(), "held-out".to_owned()];
            source.report_unknown(text.span(), format!("unknown use `{}`", text.get_ref()), &valid);
            false
        }
    }
}

/// The channels of a record; an inference finds their noise by itself.
fn channels(source: &Source, record: &Table<'_>, infers: bool) -> Vec<ChannelSection> {
    let read = |t: Table<'_>| {
        let noise = t.get("noise").and_then(|node| noise(source, node));
        if t.get("noise").is_none() && !infers {
            t.missing("noise", "the standard deviation in the channel's unit, or \"auto\"");
        }
        let surface = surface(source, &t);
        ChannelSection {
            column: match &surface {
                Some(surface) => surface.file.clone(),
                None => t.required_text("column", "a column of the record's file, or a `surface`"),
            },
            output: t.required_text("output", "the output of the model that was measured"),
            unit: t.text("unit"),
            from: t.text("from"),
            start: t.number("start"),
            held_out: held_out(source, &t),
            noise: noise.unwrap_or_else(|| Spanned::new(t.span.clone(), None)),
            surface,
        }
    };
    let keys = [
        "column",
        "output",
        "unit",
        "noise",
        "use",
        "from",
        "start",
        "surface",
        "rest",
        "open_ends",
        "noise_along",
    ];
    record.tables("channels", "a channel", &keys).into_iter().map(read).collect()
}

/// Open ends of a mesh where the study does not say: a tube's.
const TUBE_ENDS: usize = 2;

/// The surface part of a channel; nothing where it has a column.
fn surface(source: &Source, t: &Table<'_>) -> Option<SurfaceSection> {
    if t.get("surface").is_none() {
        for key in ["rest", "open_ends", "noise_along"] {
            if let Some(span) = t.key_span(key) {
                source.report_with(
                    span,
                    format!("`{key}` belongs to a `surface`"),
                    "remove it, or give `surface`",
                );
            }
        }
        return None;
    }
    for key in ["column", "from", "start"] {
        if let Some(span) = t.key_span(key) {
            let message = format!("a channel with a `surface` has no `{key}`");
            source.report_with(
                span,
                message,
                "remove it: the observed value is a distance of zero to the surface",
            );
        }
    }
    let ends =
        t.count("open_ends").map_or(TUBE_ENDS, |n| usize::try_from(*n.get_ref()).unwrap_or(usize::MAX));
    Some(SurfaceSection {
        file: t.required_text("surface", "a CSV file of profiles or meshes"),
        rest: t.required_text(
            "rest",
            "a CSV file with the place of every node of the output without displacement",
        ),
        open_ends: ends,
        noise_along: t.number("noise_along"),
    })
}

fn noise(source: &Source, node: &Node<'_>) -> Option<Spanned<Option<f64>>> {
    match node.get_ref().as_str() {
        Some("auto") => Some(Spanned::new(node.span(), None)),
        Some(_) => {
            wrong_type(source, node, "`noise`", "a number or \"auto\"");
            None
        }
        None => number(source, node, "`noise`").map(|n| Spanned::new(n.span(), Some(n.into_inner()))),
    }
}
