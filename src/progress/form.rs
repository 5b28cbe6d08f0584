//! How progress looks: a bar, lines, records, or nothing.
//!
//! Next file to read: [`super::Display`].

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use starlings_coordinator::live::Standing;

use crate::console::note;
use crate::log;

/// Spacing of plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Spacing of records for programs ...
const RECORD_EVERY: Duration = Duration::from_millis(250);
/// ... and this part of the time so far while that is shorter, so that a command of a second tells its end too.
const OF_TIME: u32 = 50;

/// Parts of a bar.
const PARTS: f64 = 10_000.0;

/// A time left beyond this is not told, s.
const MOST_S: f64 = 1e8;

/// How it looks.
pub(super) enum Form {
    /// Nothing is shown.
    Silent,
    /// A line now and then, at the edge of a stage always; the time of the last one.
    Lines(Mutex<Instant>),
    /// Records for programs, a few a second; when they began, and the time of the last one.
    Records(Instant, Mutex<Option<Instant>>),
    /// A bar.
    Bar(ProgressBar),
}

impl Form {
    pub(super) fn new(silent: bool) -> Self {
        if log::is_json() {
            return Self::Records(Instant::now(), Mutex::default());
        }
        if silent {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines(Mutex::new(Instant::now()));
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Bar(bar)
    }

    /// Shows where the work stands: at once at the edge of a stage, else when it is time.
    pub(super) fn show(&self, standing: &Standing, is_edge: bool, record: impl FnOnce(&str)) {
        let Standing { stage, says, runs, counted, workers, .. } = standing;
        let head = if says.is_empty() { stage.clone() } else { format!("{stage}: {says}") };
        let tail = format!("{runs} {counted}, {workers} workers{}", rest(standing));
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if is_edge || last.elapsed() >= LINE_EVERY {
                    note(format_args!("{head}, {tail}"));
                    *last = Instant::now();
                }
            }
            Self::Records(began, last) if is_edge || is_due(*began, last) => {
                record(&format!("{head}, {tail}"));
            }
            Self::Silent | Self::Records(..) => {}
            Self::Bar(bar) => {
                bar.set_length(PARTS as u64);
                bar.set_prefix(head);
                bar.set_message(tail);
                bar.set_position((PARTS * standing.share.unwrap_or(0.0)) as u64);
            }
        }
    }

    pub(super) fn say(&self, text: &str) {
        match self {
            Self::Silent => {}
            Self::Lines(_) | Self::Records(..) => note(format_args!("{text}")),
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

/// Whether the last record was told long enough ago; then another one is told now.
fn is_due(began: Instant, last: &Mutex<Option<Instant>>) -> bool {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    let spacing = RECORD_EVERY.min(began.elapsed() / OF_TIME);
    let is_due = last.is_none_or(|at| at.elapsed() > spacing);
    if is_due {
        *last = Some(Instant::now());
    }
    is_due
}
