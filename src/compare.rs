//! `starlings compare`: runs side by side, from their folders alone.
//!
//! Next file to read: [`page::compare`].

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::report as page;
use starlings_coordinator::report::{CompareError, Comparison};
use starlings_coordinator::study::RunFolder;
use starlings_coordinator::study::store::folder::write;

use crate::console::{line, number, table, text};
use crate::failure::Failure;

/// Set runs side by side: settings that differ, parameters with intervals, errors, and log evidence where it compares.
///
/// Only their folders are read, and nothing is run. A run that is not finished shows what it has.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folders of two runs or more.
    #[arg(value_name = "DIR", num_args = 2.., required = true)]
    dirs: Vec<PathBuf>,
    /// Also write the comparison as a page to this file.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print the comparison as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Reads the folders and prints.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let open = |dir: &PathBuf| RunFolder::open(dir).map_err(Failure::input);
    let folders = args.dirs.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let found = page::compare(&folders).map_err(|error| match error {
        CompareError::Explanation(_) => Failure::input(error),
        CompareError::Store(_) => Failure::run(error),
    })?;
    if let Some(path) = &args.html {
        spare(path, &folders)?;
        let html = page::compare_page(&found).map_err(Failure::run)?;
        write(path, &html).map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))?;
    }
    if args.json {
        return line(serde_json::to_string_pretty(&found).map_err(Failure::run)?);
    }
    text(words(&found))
}

/// Refuses to write the page over a file of a run.
fn spare(path: &std::path::Path, folders: &[RunFolder]) -> Result<(), Failure> {
    let parent =
        path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| std::path::Path::new("."));
    let Ok(parent) = parent.canonicalize() else { return Ok(()) };
    if folders.iter().any(|folder| folder.path.canonicalize().is_ok_and(|own| own == parent)) {
        let says = "is in the folder of a run: choose another place with --html";
        return Err(Failure::input(format!("{} {says}", path.display())));
    }
    Ok(())
}

/// The comparison in words.
fn words(found: &Comparison) -> String {
    let labels = found.labels();
    let head =
        |first: &str| std::iter::once(first.to_owned()).chain(labels.iter().cloned()).collect::<Vec<_>>();
    let absent = || "–".to_owned();
    let mut said = format!("{}\n", found.verdict());
    let mut section = |title: &str, rows: Vec<Vec<String>>| {
        if rows.len() > 1 {
            said.extend(["\n", title, "\n", &table(&rows, false)]);
        }
    };
    let runs = found
        .runs
        .iter()
        .zip(&labels)
        .map(|(run, label)| vec![label.clone(), run.study.clone(), run.model.clone(), run.state.clone()]);
    section(
        "Runs",
        std::iter::once(["run", "study", "model", "state"].map(str::to_owned).to_vec()).chain(runs).collect(),
    );
    let settings = found.settings.iter().map(|setting| {
        let values = setting.values.iter().map(|v| v.clone().unwrap_or_else(absent));
        std::iter::once(setting.path.clone()).chain(values).collect()
    });
    section("Settings that differ", std::iter::once(head("setting")).chain(settings).collect());
    let parameters = found.parameters.iter().map(|p| {
        let cell = |e: &Option<_>| e.as_ref().map_or_else(absent, interval);
        let name = if p.unit.is_empty() { p.name.clone() } else { format!("{} [{}]", p.name, p.unit) };
        let apart = p.apart.map_or_else(absent, |d| format!("{d:.1} sd apart"));
        std::iter::once(name).chain(p.values.iter().map(cell)).chain([apart]).collect()
    });
    section(
        "Parameters, with 95 % intervals at the stated noise",
        std::iter::once(head("parameter")).chain(parameters).collect(),
    );
    let errors = found.errors.iter().flat_map(|error| {
        let of = |v: Option<f64>| v.map_or_else(absent, |v| number(v, None));
        let row = |name: &str, values: Vec<Option<f64>>| {
            std::iter::once(format!("{}, {name}", error.output))
                .chain(values.into_iter().map(of))
                .collect::<Vec<_>>()
        };
        let train = error.values.iter().map(|c| c.as_ref()?.train_rmse).collect();
        let held_out = error.values.iter().map(|c| c.as_ref()?.held_out_rmse).collect();
        [row("training RMSE", train), row("held-out RMSE", held_out)]
    });
    let shown = |v: &Option<f64>| v.map_or_else(absent, |v| format!("{v:.2}"));
    let evidence =
        std::iter::once("log evidence".to_owned()).chain(found.evidence.values.iter().map(shown)).collect();
    section("Errors and evidence", std::iter::once(head("of")).chain(errors).chain([evidence]).collect());
    said + &format!("\n{}\n", found.evidence.says)
}

fn interval(e: &starlings_coordinator::study::posterior::Estimate) -> String {
    let digits = |v| number(v, Some(e.sd));
    format!("{} ({} to {})", digits(e.estimate), digits(e.interval95[0]), digits(e.interval95[1]))
}
