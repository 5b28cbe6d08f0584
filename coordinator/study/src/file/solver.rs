//! Reading `[model]` where the model runs in a program of its own.
//!
//! Every adapter has its keys; those of another are reported. Whether files exist and what the solver's description holds is
//! not checked here. Next file to read: [`crate::check`], module `solver`.

use std::ops::Range;

use starlings_models::{Role, did_you_mean, nearest, quoted_list};
use starlings_proto::adapters::{AdapterDef, NamedBy};
use toml::Spanned;

use super::Named;
use super::memory::memory;
use super::quantity::{role, unit};
use super::table::{Node, Table, named_texts, text, wrong_type};
use crate::problem::Source;

/// Keys of `[model]` that only a solver has.
pub(crate) const KEYS: [&str; 18] = [
    "adapter",
    "command",
    "address",
    "folder",
    "environment",
    "timeout",
    "start_timeout",
    "threads",
    "pin",
    "memory",
    "ranks",
    "model",
    "described",
    "parameters",
    "outputs",
    "inputs",
    "templates",
    "copies",
];

/// How one of them begins that reads an output.
const RULES: [&str; 4] = ["json", "csv", "column", "regex"];

/// `[model]` of a solver.
#[derive(Debug)]
pub(crate) struct ProgramSection {
    /// Where the program, or else its address, is named.
    pub(crate) place: Range<usize>,
    pub(crate) adapter: String,
    /// Whether it is started for every run.
    pub(crate) per_run: bool,
    pub(crate) command: Vec<String>,
    pub(crate) address: Option<String>,
    /// Where it runs, as seen from the study.
    pub(crate) folder: Option<Spanned<String>>,
    pub(crate) environment: Named<String>,
    pub(crate) timeout: Option<Spanned<f64>>,
    pub(crate) start_timeout: Option<Spanned<f64>>,
    pub(crate) threads: Option<Spanned<u64>>,
    pub(crate) pin: bool,
    /// Bytes.
    pub(crate) memory: Option<u64>,
    pub(crate) ranks: Option<Spanned<u64>>,
    pub(crate) model: Option<String>,
    /// File with a description.
    pub(crate) described: Option<Spanned<String>>,
    pub(crate) parameters: Vec<ProgramQuantity>,
    pub(crate) outputs: Vec<ProgramQuantity>,
    pub(crate) inputs: Vec<ProgramQuantity>,
    /// File of the run and file of its template.
    pub(crate) templates: Named<String>,
    /// File of the run and file that is copied.
    pub(crate) copies: Named<String>,
}

/// A parameter, an output or an input of a program.
#[derive(Debug)]
pub(crate) struct ProgramQuantity {
    pub(crate) name: Spanned<String>,
    pub(crate) unit: String,
    pub(crate) role: Role,
    pub(crate) default: Option<Spanned<f64>>,
    pub(crate) range: Option<Spanned<[f64; 2]>>,
    pub(crate) size: Option<Spanned<u64>>,
    /// Where an output is read.
    pub(crate) read: Option<Spanned<String>>,
}

/// Reads `[model]` of a solver, whose `kind` stands at `kind`.
pub(crate) fn program(
    source: &Source,
    t: &Table<'_>,
    kind: Range<usize>,
    adapters: &[AdapterDef],
) -> ProgramSection {
    let adapter = adapter(source, t, adapters);
    let known = adapters.iter().find(|known| known.name == adapter);
    if let Some(known) = known {
        refuse_foreign(source, t, known, adapters);
    }
    let command = t.texts("command");
    let address = t.text("address");
    check_reach(source, t, known, &command, &kind);
    let place = |key| t.get(key).map(Node::span);
    let section = ProgramSection {
        place: place("command").or_else(|| place("address")).unwrap_or(kind),
        command: command.into_iter().map(Spanned::into_inner).collect(),
        address: address.map(Spanned::into_inner),
        folder: t.text("folder"),
        environment: named_texts(source, &t.free_entries("environment")),
        timeout: t.number("timeout"),
        start_timeout: t.number("start_timeout"),
        threads: t.count("threads"),
        pin: t.flag("pin").is_some_and(Spanned::into_inner),
        memory: t.get("memory").and_then(|node| memory(source, node)),
        ranks: t.count("ranks"),
        model: t.text("model").map(Spanned::into_inner),
        described: t.text("described"),
        parameters: quantities(source, t, "parameters", &["name", "unit", "role", "default", "range"]),
        outputs: quantities(source, t, "outputs", output_keys(known)),
        inputs: quantities(source, t, "inputs", &["name", "unit", "role"]),
        templates: named_texts(source, &t.free_entries("templates")),
        copies: copies(source, t),
        adapter,
        per_run: known.is_some_and(|known| known.per_run),
    };
    if section.per_run {
        for (key, expected) in [
            ("parameters", "such as `[ { name = \"E\", unit = \"Pa\" } ]`"),
            ("outputs", "such as `[ { name = \"tip\", unit = \"m\", read = \"csv:result.csv:tip\" } ]`"),
        ] {
            if t.get(key).is_none() {
                t.missing(key, expected);
            }
        }
    }
    section
}

/// The keys of an output, without `read` for an adapter whose program is not started for every run.
fn output_keys(adapter: Option<&AdapterDef>) -> &'static [&'static str] {
    if adapter.is_some_and(|known| known.keys.contains(&"outputs") && !known.per_run) {
        &["name", "unit", "role", "size"]
    } else {
        &["name", "unit", "role", "size", "read"]
    }
}

fn adapter(source: &Source, t: &Table<'_>, adapters: &[AdapterDef]) -> String {
    let Some(word) = t.text("adapter") else { return "grpc".to_owned() };
    // Where no solver can be reached at all, the one that is asked for its description says so.
    if !adapters.is_empty() && adapters.iter().all(|known| known.name != word.get_ref()) {
        let valid: Vec<String> = adapters.iter().map(|adapter| adapter.name.to_owned()).collect();
        source.report_unknown(word.span(), format!("unknown adapter `{}`", word.get_ref()), &valid);
    }
    word.into_inner()
}

/// Keys of another adapter: they would be ignored silently.
fn refuse_foreign(source: &Source, t: &Table<'_>, adapter: &AdapterDef, adapters: &[AdapterDef]) {
    for key in KEYS {
        let owners: Vec<String> = adapters
            .iter()
            .filter(|other| other.keys.contains(&key))
            .map(|other| format!("\"{}\"", other.name))
            .collect();
        if let Some(span) = t.key_span(key).filter(|_| !owners.is_empty() && !adapter.keys.contains(&key)) {
            let (owners, own) = (owners.join(" or "), adapter.name);
            let message = format!("`{key}` belongs to adapter = {owners}, this one is \"{own}\"");
            source.report_with(span, message, format!("remove it, or use adapter = {owners}"));
        }
    }
}

/// Every solver is either started or reached at an address; both are given only for a server that is started too.
fn check_reach(
    source: &Source,
    t: &Table<'_>,
    adapter: Option<&AdapterDef>,
    command: &[Spanned<String>],
    kind: &Range<usize>,
) {
    if t.get("command").is_some_and(|node| node.get_ref().as_array().is_some_and(|list| list.is_empty()))
        || command.first().is_some_and(|program| program.get_ref().is_empty())
    {
        let span = t.get("command").map_or(kind.clone(), Node::span);
        source.report_with(
            span,
            "`command` names no program",
            "such as `command = [\"python3\", \"beam.py\"]`",
        );
        return;
    }
    let has = |key| t.get(key).is_some();
    match adapter.map(|known| known.named_by) {
        Some(NamedBy::Address(expected)) if !has("address") => t.missing("address", expected),
        Some(NamedBy::CommandOrAddress(_)) if has("command") && has("address") => {
            let span = t.key_span("address").unwrap_or(kind.clone());
            let message = "`command` starts a solver and `address` dials one that runs already";
            source.report_with(span, message, "remove one of the two");
        }
        Some(NamedBy::CommandOrAddress(expected)) if !has("command") && !has("address") => {
            t.missing("command", expected);
        }
        Some(NamedBy::Command(expected)) if !has("command") => t.missing("command", expected),
        _ => {}
    }
}

fn quantities(source: &Source, model: &Table<'_>, key: &str, keys: &[&str]) -> Vec<ProgramQuantity> {
    let name = match key {
        "parameters" => "a parameter of the solver",
        "outputs" => "an output of the solver",
        _ => "an input of the solver",
    };
    let read = |t: Table<'_>| {
        let rule = t.text("read");
        if let Some(rule) = &rule {
            check_rule(source, rule);
        }
        ProgramQuantity {
            name: t.required_text("name", "how the study and the program call it"),
            unit: unit(&t),
            role: role(source, &t).unwrap_or_default(),
            default: t.number("default"),
            range: t.interval("range"),
            size: t.count("size"),
            read: rule,
        }
    };
    model.tables(key, name, keys).into_iter().map(read).collect()
}

fn check_rule(source: &Source, rule: &Spanned<String>) {
    let kind = rule.get_ref().split(':').next().unwrap_or_default();
    if !RULES.contains(&kind) {
        let near = nearest(kind, RULES);
        let help = match near {
            Some(near) => did_you_mean(near),
            None => {
                "such as `json`, `csv:FILE:COLUMN`, `column:FILE:NUMBER` or `regex:FILE:PATTERN`".to_owned()
            }
        };
        let message = format!(
            "`{}` is no rule to read an output: it begins with none of {}",
            rule.get_ref(),
            quoted_list(RULES)
        );
        source.report_with(rule.span(), message, help);
    }
}

/// A list of files, or a table file of the run = file.
fn copies(source: &Source, t: &Table<'_>) -> Named<String> {
    let Some(node) = t.get("copies") else { return Vec::new() };
    if node.get_ref().is_table() {
        return named_texts(source, &t.free_entries("copies"));
    }
    let Some(list) = node.get_ref().as_array() else {
        wrong_type(
            source,
            node,
            "`copies`",
            "a list of files, or a table `{ \"file of the run\" = \"file\" }`",
        );
        return Vec::new();
    };
    let read = |node: &Node<'_>| {
        let path = text(source, node, "an entry of `copies`")?;
        let name = path.get_ref().rsplit('/').next().unwrap_or_default().to_owned();
        Some((Spanned::new(path.span(), name), path))
    };
    list.iter().filter_map(read).collect()
}
