//! The form of what goes to standard error: text for people, or a JSON object a line for programs.
//!
//! The fields and their names are those of `docs/watching.md`. Next file to read: [`crate::note`], for what people read.

use std::io::IsTerminal;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use clap::ValueEnum;
use starlings_coordinator::fleet::FleetEvent;
use starlings_coordinator::live::Standing;
use starlings_coordinator::study::Stage;
use starlings_coordinator::{infer, study};
use starlings_worker::{News, Tell};
use tracing_subscriber::filter::LevelFilter;

/// Name of the event of every record that says where the work stands.
const PROGRESS: &str = "progress";

/// The form, once it is chosen.
static FORMAT: OnceLock<LogFormat> = OnceLock::new();

/// How lines on standard error are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// For people.
    Text,
    /// A JSON object a line, for programs.
    Json,
}

/// Sends log lines to standard error: of a text warnings, of JSON what people would be told as well, or more with each `-v`.
pub(crate) fn to_stderr(format: LogFormat, verbose: u8) {
    let _ = FORMAT.set(format);
    let level = match verbose + u8::from(format == LogFormat::Json) {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    // Where nobody reads any more the work goes on: what cannot be written is not complained of on the same closed stream.
    let lines = tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_max_level(level)
        .log_internal_errors(false);
    match format {
        LogFormat::Text => lines.with_ansi(std::io::stderr().is_terminal()).with_target(false).init(),
        LogFormat::Json => lines.json().with_current_span(false).with_span_list(false).init(),
    }
}

/// Whether standard error is for programs.
pub(crate) fn is_json() -> bool {
    FORMAT.get() == Some(&LogFormat::Json)
}

/// An event of a fleet, with what is `said` of it.
pub(crate) fn fleet(run: &str, event: &FleetEvent, said: &str) {
    let (kind, worker) = (event.kind(), event.worker());
    let (particle, record) = event.job().unzip();
    if event.is_notable() {
        tracing::warn!(event = kind, run, worker, particle, record, "{said}");
    } else {
        tracing::info!(event = kind, run, worker, particle, record, "{said}");
    }
}

/// One analysis more, with what is `said` of it.
pub(crate) fn step(at: &study::Progress, Standing { share, left_s, .. }: &Standing, said: &str) {
    let (stage, pass, passes) = (at.stage, at.pass, at.passes);
    let (step, steps, runs, workers) = (at.step, at.steps, at.runs, at.workers);
    tracing::info!(
        event = PROGRESS,
        stage,
        pass,
        passes,
        step,
        steps,
        runs,
        workers,
        share,
        left_s,
        "{said}"
    );
}

/// A command goes on whose work has stages.
pub(crate) fn stage(at: &Stage, Standing { share, left_s, .. }: &Standing, said: &str) {
    let (stage, runs, workers) = (at.name, at.runs, at.workers);
    tracing::info!(event = PROGRESS, stage, runs, workers, share, left_s, "{said}");
}

/// An inference goes on.
pub(crate) fn blocks(at: &infer::Progress, Standing { share, left_s, .. }: &Standing, said: &str) {
    let (stage, blocks, workers) = (at.stage, at.n_block, at.workers);
    tracing::info!(event = PROGRESS, stage, blocks, workers, share, left_s, "{said}");
}

/// Records the news of a worker, with the run and the connection that it had last; `name` is the end of its name at its coordinators.
pub(crate) fn worker(name: String) -> Tell {
    let last = Mutex::new(None);
    Arc::new(move |news| {
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        if let News::Connected { run, epoch, .. } = news {
            *last = Some((run.clone(), *epoch));
        }
        let (run, epoch) = last.as_ref().map(|(run, epoch): &(String, u64)| (run.as_str(), *epoch)).unzip();
        tracing::info!(event = news.kind(), run, worker = name, epoch, "{news}");
    })
}
