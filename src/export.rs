//! `starlings export`: one table of a run folder as CSV.

use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use starlings_coordinator::study::{RunFolder, store};

use crate::csv_file::{self, StudyLocation};
use crate::failure::Failure;

/// Write a table of a run folder as CSV.
#[derive(Parser)]
pub(crate) struct Args {
    /// The run folder.
    dir: PathBuf,
    /// Which table.
    #[arg(long, value_enum, default_value_t = Table::Estimates)]
    table: Table,
    /// Where to write; standard output without it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Table {
    /// Every parameter after every analysis: median, band of two sd, mean and sd in transformed units.
    Estimates,
    /// Observed minus predicted before each analysis, with the sd the filter expected.
    Innovations,
    /// The free forward run with the estimate, beside what was observed.
    Predictions,
    /// Time, observations used, NIS and log-likelihood of every analysis.
    Analyses,
    /// Every run of the model: particle, worker, attempts, cost, error.
    Jobs,
    /// What happened to the run and its fleet.
    Events,
}

/// Writes the table.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let folder = RunFolder::open(&args.dir).map_err(Failure::input)?;
    spare(args, &folder)?;
    let (name, columns) = match args.table {
        Table::Estimates => ("estimates", "pass, step, parameter, estimate, lo, hi, mean, sd"),
        Table::Innovations => ("innovations", "pass, step, record, output, time, innovation, sd"),
        Table::Predictions => ("predictions", "record, output, time, observed, predicted, use, noise"),
        Table::Analyses => ("analyses", "pass, step, time, n_used, nis, log_likelihood, information_lost"),
        Table::Jobs => ("jobs", "pass, step, record, particle, attempts, worker, status, error, cost_s"),
        Table::Events => ("events", "at_s, kind, text"),
    };
    let rows = store::table(&folder.store, name, columns).map_err(Failure::run)?;
    let heading = columns.split(", ").map(str::to_owned).collect();
    csv_file::write(args.output.as_deref(), std::iter::once(heading).chain(rows))
}

/// Refuses to write over the run itself, its study or the study's data.
fn spare(args: &Args, folder: &RunFolder) -> Result<(), Failure> {
    let output = args.output.as_deref();
    let inside = |path: &Path| {
        let (path, dir) = (path.canonicalize().ok()?, args.dir.canonicalize().ok()?);
        Some(path.parent()? == dir)
    };
    if let Some(path) = output.filter(|path| inside(path).unwrap_or(false)) {
        let path = path.display();
        return Err(Failure::input(format!("{path} is a file of the run: choose another file with -o")));
    }
    let study = folder.store.meta("study").map_err(Failure::run)?.unwrap_or_default();
    csv_file::check_outputs(&[("-o", &args.output)], &study, &StudyLocation::Unknown)
}
