//! `starlings models`: the catalogue, written by the models themselves.

use clap::Parser;
use starlings_models::{ModelDef, Quantity, Spec, catalogue, meant, nearest};

use crate::console::{line, table, text};
use crate::failure::Failure;

/// List the built-in models, or describe one.
#[derive(Parser)]
pub(crate) struct Args {
    /// Model kind to describe; all kinds are listed without it.
    kind: Option<String>,
    /// Print the catalogue as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Prints the catalogue or one of its entries.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut specs: Vec<Spec> = catalogue::specs();
    if let Some(kind) = &args.kind {
        let names: Vec<String> = specs.iter().map(|s| s.kind.clone()).collect();
        specs.retain(|s| s.kind == *kind);
        if specs.is_empty() {
            let hint = meant(nearest(kind, &names));
            return Err(Failure::input(format!(
                "no model named `{kind}`{hint} (known: {})",
                names.join(", ")
            )));
        }
    }
    if args.json {
        line(serde_json::to_string_pretty(&specs).map_err(Failure::run)?)
    } else if args.kind.is_some() {
        specs.iter().try_for_each(describe)
    } else {
        let mut rows = vec![vec!["kind".to_owned(), "what it is".to_owned()]];
        rows.extend(specs.iter().map(|s| vec![s.kind.clone(), s.says.clone()]));
        text(table(&rows, false))?;
        line("\n`starlings models KIND` lists parameters, states, outputs and inputs.")
    }
}

fn describe(spec: &Spec) -> Result<(), Failure> {
    line(format_args!("{}: {}", spec.kind, spec.says))?;
    let lists = [
        ("parameters", &spec.parameters),
        ("states", &spec.states),
        ("outputs", &spec.outputs),
        ("inputs", &spec.inputs),
    ];
    for (title, quantities) in lists {
        if quantities.is_empty() {
            continue;
        }
        line(format_args!("\n{title}"))?;
        let mut rows = vec![["name", "unit", "range", "default", "meaning"].map(str::to_owned).to_vec()];
        rows.extend(quantities.iter().map(row));
        text(table(&rows, false))?;
    }
    let fields: Vec<&Quantity> = spec.states.iter().chain(&spec.outputs).filter(|q| q.size > 1).collect();
    if let Some(field) = fields.first() {
        line(format_args!(
            "\n`name[0..n]` is a field of n components, `{0}[0]` to `{0}[{1}]`",
            field.name,
            field.size - 1
        ))?;
    }
    if has_layout(&spec.kind) {
        line("\nsizes are those of the default layout; `[model.layout]` of the study changes it")?;
    }
    line("\nestimate an initial value with the parameter name `initial:<state>`")
}

/// Whether the model is put together by the study: a model without a layout refuses the empty one.
fn has_layout(kind: &str) -> bool {
    let layout = Some(serde_json::json!({}));
    catalogue::build(&ModelDef { kind: kind.to_owned(), layout, ..ModelDef::default() }).is_ok()
}

fn row(q: &Quantity) -> Vec<String> {
    vec![
        if q.size == 1 { q.name.clone() } else { format!("{}[0..{}]", q.name, q.size) },
        q.unit.clone(),
        q.range_text(),
        q.default.map(|v| v.to_string()).unwrap_or_default(),
        q.says.clone(),
    ]
}
