//! `starlings report`: the result files of a run folder, written again from its store.

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::report as page;
use starlings_coordinator::study::RunFolder;
use starlings_coordinator::study::store::Purpose;

use crate::console::{line, note};
use crate::failure::Failure;
use crate::{diagnose, infer};

/// Write the result files of a run folder again from its run.db: report.html, and the numbers beside it.
///
/// A run has summary.json and posterior.csv, an explanation explain.json and explained.toml.
#[derive(Parser)]
pub(crate) struct Args {
    /// The run folder.
    dir: PathBuf,
    /// Also write the overview picture (SVG) to this file.
    #[arg(long, value_name = "FILE")]
    overview: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes the files; a run that is not finished gets a report of what there is.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.dir.join(infer::RESULT).is_file() {
        return infer::write_again(&args.dir, args.overview.is_some(), args.json);
    }
    if args.dir.join(diagnose::RESULT).is_file() {
        return diagnose::write_again(&args.dir, args.overview.is_some(), args.json);
    }
    let folder = RunFolder::open(&args.dir).map_err(Failure::input)?;
    if folder.purpose().map_err(Failure::run)? == Purpose::Explanation {
        return explanation(args, &folder);
    }
    let data = page::reader::report_data(&folder.store).map_err(Failure::run)?;
    if let Some(path) = &args.overview {
        let svg = page::overview_svg(&data);
        std::fs::write(path, svg)
            .map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))?;
    }
    let summary = folder.summary().map_err(Failure::run)?;
    let html = args.dir.join("report.html");
    if summary.is_some() {
        page::write_files(&folder).map_err(Failure::run)?;
    } else {
        page::write_page(&folder).map_err(Failure::run)?;
        note(format_args!(
            "the run is not finished: the report shows what there is, and the other files are not written"
        ));
    }
    if !args.json {
        return line(html.display());
    }
    let shown = match &summary {
        Some(summary) => serde_json::to_value(summary).map_err(Failure::run)?,
        None => serde_json::json!({ "study": data.study, "finished": false, "warnings": data.warnings }),
    };
    line(format_args!("{shown:#}"))
}

/// The files of an explanation.
fn explanation(args: &Args, folder: &RunFolder) -> Result<(), Failure> {
    if args.overview.is_some() {
        return Err(Failure::input("an explanation has no overview picture: leave out --overview"));
    }
    crate::explain::write(folder, args.json)
}
