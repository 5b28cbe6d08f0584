//! How progress looks: a bar, lines, records, or nothing.
//!
//! Next file to read: [`super::Display`].

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use starlings_coordinator::live::Standing;
use starlings_coordinator::{infer, study};

use crate::console::note;
use crate::log;

/// Spacing of plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Spacing of records for programs.
const RECORD_EVERY: Duration = Duration::from_millis(250);

/// Parts of a bar.
const PARTS: f64 = 10_000.0;

/// A time left beyond this is not told, s.
const MOST_S: f64 = 1e8;

/// Spacing of the pictures of a spinner.
const TICK: Duration = Duration::from_millis(100);

/// The line that was shown last.
pub(super) struct Last {
    at: Instant,
    /// Name of the stage, and what it said.
    stage: Option<(String, String)>,
}

/// How it looks.
pub(super) enum Form {
    /// Nothing is shown.
    Silent,
    /// A line now and then, the first and the last of a pass always.
    Lines(Mutex<Last>),
    /// Records for programs, a few a second; the time of the last one.
    Records(Mutex<Option<Instant>>),
    /// A bar.
    Bar(ProgressBar),
}

impl Form {
    pub(super) fn new(silent: bool) -> Self {
        if log::is_json() {
            return Self::Records(Mutex::new(None));
        }
        if silent {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines(Mutex::new(Last { at: Instant::now(), stage: None }));
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Bar(bar)
    }

    pub(super) fn step(&self, standing: &Standing, p: &study::Progress) {
        let Standing { stage: head, says, runs, workers, .. } = standing;
        let tail = format!("{runs} runs, {workers} workers{}", rest(standing));
        let is_edge = p.step == 1 || p.step == p.steps;
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if is_edge || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{head}: {says}, {tail}"));
                    last.at = Instant::now();
                }
            }
            Self::Records(last) if is_edge || is_due(last) => {
                log::step(p, &format!("{head}: {says}, {tail}"));
            }
            Self::Silent | Self::Records(_) => {}
            Self::Bar(bar) => {
                bar.set_length(PARTS as u64);
                bar.set_prefix(format!("{head}: {says}"));
                bar.set_message(tail);
                bar.set_position((PARTS * standing.share.unwrap_or(0.0)) as u64);
            }
        }
    }

    /// The batch of runs goes on that a step told of.
    pub(super) fn batch(&self, standing: &Standing) {
        let Standing { stage, says, runs, workers, .. } = standing;
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{stage}: {says}, {runs} runs, {workers} workers{}", rest(standing)));
                    last.at = Instant::now();
                }
            }
            Self::Bar(bar) => {
                bar.set_message(format!("{runs} runs, {workers} workers{}", rest(standing)));
                bar.set_position((PARTS * standing.share.unwrap_or(0.0)) as u64);
            }
            Self::Silent | Self::Records(_) => {}
        }
    }

    pub(super) fn stage(&self, standing: &Standing, record: impl FnOnce(&str)) {
        let Standing { stage: name, says, runs, workers, .. } = standing;
        let begins = if says.is_empty() { String::new() } else { format!("{says}, ") };
        let tail = format!("{begins}{runs} runs, {workers} workers");
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                let told =
                    |(last, said): &(String, String)| last == name && (says.is_empty() || said == says);
                let new = !last.stage.as_ref().is_some_and(told);
                if new || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{name}: {tail}"));
                    last.at = Instant::now();
                    last.stage = Some((name.clone(), says.clone()));
                }
            }
            Self::Records(last) if is_due(last) => record(&format!("{name}: {tail}")),
            Self::Silent | Self::Records(_) => {}
            Self::Bar(bar) => spin(bar, name, tail),
        }
    }

    pub(super) fn blocks(&self, standing: &Standing, at: &infer::Progress) {
        let Standing { stage, says, workers, .. } = standing;
        let tail = format!("{says}, {workers} workers");
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if at.n_block == 1 || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{stage}: {tail}"));
                    last.at = Instant::now();
                }
            }
            Self::Records(last) if at.n_block == 1 || is_due(last) => {
                log::blocks(at, &format!("{stage}: {tail}"));
            }
            Self::Silent | Self::Records(_) => {}
            Self::Bar(bar) => spin(bar, stage, tail),
        }
    }

    pub(super) fn say(&self, text: &str) {
        match self {
            Self::Silent => {}
            Self::Lines(_) | Self::Records(_) => note(format_args!("{text}")),
            Self::Bar(bar) => bar.suspend(|| note(format_args!("{text}"))),
        }
    }

    pub(super) fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Share and time left, where they are known.
fn rest(standing: &Standing) -> String {
    let share = standing.share.map(|share| format!(", {:.0} %", 100.0 * share));
    let left = standing.left_s.filter(|left| *left < MOST_S).map(|left| {
        format!(", about {} left", HumanDuration(Duration::from_secs_f64(left.max(0.0).round())))
    });
    share.into_iter().chain(left).collect()
}

/// Shows a stage of which nobody knows how long it is.
fn spin(bar: &ProgressBar, name: &str, tail: String) {
    if bar.prefix() != name {
        let spinner = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg} {elapsed}");
        bar.set_style(spinner.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.set_prefix(name.to_owned());
        bar.enable_steady_tick(TICK);
    }
    bar.set_message(tail);
}

/// Whether the last record was told long enough ago; then another one is told now.
fn is_due(last: &Mutex<Option<Instant>>) -> bool {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    let is_due = last.is_none_or(|at| at.elapsed() > RECORD_EVERY);
    if is_due {
        *last = Some(Instant::now());
    }
    is_due
}
