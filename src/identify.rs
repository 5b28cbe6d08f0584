//! `starlings identify`: is the estimation reasonable, before it is made?

use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::fleet::RunIdentity;
use starlings_coordinator::report::identify_page;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::identify::{At, Identification, IdentifyError, identify};
use starlings_coordinator::study::trial::{Depth, dry_run};
use starlings_estimators::BATCH;

use crate::console::{line, note, number, table, text};
use crate::csv_file::{self, StudyLocation};
use crate::disk;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, finish};
use crate::interrupt;
use crate::load::load_where;
use crate::progress::Display;
use crate::run::hangs_on;

/// At most this many lines of a list are printed; the rest is in the JSON and on the page.
const LINES: usize = 8;

/// Say what these data could determine: expected standard deviations, correlations, combinations without information.
///
/// One ensemble of runs around the prior median gives the sensitivities; the measured values themselves play no role. The
/// observer of the study is off: every record runs freely, as in the batch fit.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Where to take the sensitivities: `prior` (median), or the folder of a finished run (its estimate).
    #[arg(long, value_name = "prior|DIR", default_value = "prior")]
    at: String,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Write the page with all figures to this file.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write sensitivities and generalised sensitivities of every observed value to this file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print the result as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Runs the ensemble and prints what it says.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut study = load_where(&args.study, args.fleet.is_here())?;
    let plan = args.fleet.plan(&study, None)?;
    let outputs = [("--html", &args.html), ("--csv", &args.csv)];
    csv_file::check_outputs(&outputs, &study.text, &StudyLocation::Known(&study.file))?;
    let at = At::from_argument(&args.at);
    at.centre(&study).map_err(Failure::input)?;
    let is_away = args.fleet.workers_try(&study);
    if !is_away {
        dry_run(&mut study, &BATCH, Depth::First).map_err(Failure::input)?;
    }
    disk::check_states(&study, plan.place().as_deref(), false)?;
    let display = Display::new(args.json);
    let mut session =
        FleetSession::listen(&study, &plan, Entrance::take(&plan, None)?, RunIdentity::new(), &display)?;
    session.show(&study, "identify", None, &display)?;
    session.start_workers(&study, &plan, None)?;
    if is_away {
        session.trial(&mut study, Some(&BATCH), None)?;
    }
    if !args.json {
        let records = study.records.iter().filter(|record| record.is_trained()).count();
        let runs = (2 * study.parameters.len() + 1) * records;
        display.say(&format!(
            "{runs} runs of the model: a centre and a pair per parameter, over {records} record{}; then one per constant and record",
            if records == 1 { "" } else { "s" }
        ));
    }
    let result = identify(&study, &mut session.fleet, &at, &mut |at| display.stage(at));
    display.finish();
    let page = session.close(result.is_ok());
    let found = result.map_err(|error| match error {
        IdentifyError::Run(cause) if cause.is_cancelled() => {
            interrupt::failure("nothing is kept of it: start again")
        }
        error if error.is_input() => Failure::input(error),
        error => Failure::run(error),
    })?;
    if let Some(path) = &args.csv {
        csv_file::write(Some(path), table_of_rows(&study, &found))?;
    }
    if let Some(path) = &args.html {
        write_page(path, &found)?;
    }
    finish(page, args.html.as_deref());
    if args.json {
        return line(serde_json::to_string_pretty(&found).map_err(Failure::run)?);
    }
    print(&found)?;
    for path in [&args.html, &args.csv].into_iter().flatten() {
        note(format_args!("written: {}", path.display()));
    }
    Ok(())
}

fn write_page(path: &Path, found: &Identification) -> Result<(), Failure> {
    let page = identify_page(found).map_err(Failure::run)?;
    std::fs::write(path, page).map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))
}

/// One row per observed value, then per parameter the sensitivity and the generalised sensitivity up to its time.
fn table_of_rows(study: &Study, found: &Identification) -> Vec<Vec<String>> {
    let names = || found.parameters.iter().map(|p| p.name.as_str());
    let fixed = ["record", "time", "output", "noise", "prediction"].map(str::to_owned);
    let heading = fixed.into_iter().chain(names().map(|n| format!("sensitivity:{n}")));
    let mut rows = vec![heading.chain(names().map(|n| format!("gsf:{n}"))).collect::<Vec<_>>()];
    for (i, row) in found.rows.iter().enumerate() {
        let fixed = [
            study.records[row.record].name.clone(),
            format!("{:?}", row.time),
            found.outputs[row.output].clone(),
            format!("{:?}", row.noise),
            format!("{:?}", row.prediction),
        ];
        let sensitivities = found.whitened.row(i).iter().map(|v| format!("{v:?}")).collect::<Vec<_>>();
        let at_step =
            |curve: &Option<Vec<f64>>| curve.as_ref().map_or(String::new(), |c| format!("{:?}", c[row.step]));
        let functions = found.gsf.curves.iter().map(|(_, curve)| at_step(curve));
        rows.push(fixed.into_iter().chain(sensitivities).chain(functions).collect());
    }
    rows
}

fn print(found: &Identification) -> Result<(), Failure> {
    line(format_args!(
        "{}: model {}, at {}; {} observed values, {} runs on {} worker{}",
        found.study,
        found.model,
        found.at,
        found.n_obs,
        found.runs,
        found.workers,
        if found.workers == 1 { "" } else { "s" }
    ))?;
    for warning in &found.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    line("\nwhat the data would leave of each parameter's prior")?;
    text(parameters(found))?;
    pairs(found)?;
    line("\ncombinations, the least informed first (each parameter in units of its prior sd)")?;
    text(combinations(found))?;
    let index = found.collinearity.index.map_or_else(|| "beyond measure".to_owned(), |v| format!("{v:.2}"));
    line(format_args!("\ncollinearity index of the whole set: {index} (critical from about 10)"))?;
    if found.hangs_on.runs > 0 {
        line("")?;
        hangs_on(&found.hangs_on)?;
    }
    line(format_args!("\n{}", found.advice))?;
    line(&found.conditional_on)
}

fn parameters(found: &Identification) -> String {
    let heading =
        ["parameter", "unit", "value", "expected sd", "prior sd", "left of prior", "informed", "bit"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    for p in &found.parameters {
        rows.push(vec![
            p.name.clone(),
            p.unit.clone(),
            number(p.value, Some(p.expected_sd_physical)),
            number(p.expected_sd_physical, Some(p.expected_sd_physical)),
            number(p.prior_sd_physical, Some(p.prior_sd_physical)),
            percent(p.expected_sd / p.prior_sd),
            percent(p.informed),
            format!("{:.1}", p.information_bits),
        ]);
    }
    table(&rows, false)
}

/// Correlated pairs, the strongest first.
fn pairs(found: &Identification) -> Result<(), Failure> {
    let pairs = found.correlated_pairs();
    if pairs.is_empty() {
        return line("\nno pair of parameters is correlated beyond 0.95");
    }
    line("\npairs correlated beyond 0.95, by the data alone")?;
    for (i, j, c) in pairs.iter().take(LINES) {
        line(format_args!("  {} and {}: {c:.3}", found.parameters[*i].name, found.parameters[*j].name))?;
    }
    if pairs.len() > LINES { line(format_args!("  and {} more", pairs.len() - LINES)) } else { Ok(()) }
}

fn combinations(found: &Identification) -> String {
    let mut rows = vec![["combination", "left of prior", "sd by the data alone"].map(str::to_owned).to_vec()];
    for d in found.directions.iter().take(LINES) {
        let alone = d
            .standard_error
            .map_or_else(|| "no information".to_owned(), |sd| format!("{} {}", number(sd, Some(sd)), d.unit));
        rows.push(vec![d.combination.clone(), percent(d.share), alone]);
    }
    table(&rows, false)
}

/// A share in percent; digits where they matter.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 10.0 { format!("{percent:.2} %") } else { format!("{percent:.1} %") }
}
