//! Progress: a bar on a terminal, plain lines elsewhere, nothing with `--json`.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use starlings_coordinator::study::Progress;

use crate::console::note;

/// Spacing of plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shows where a run stands.
pub(crate) enum Display {
    /// Nothing is shown.
    Silent,
    /// A line now and then, the first and the last of a pass always.
    Lines(Mutex<Instant>),
    /// A bar.
    Bar(ProgressBar),
}

impl Display {
    /// A bar if standard error is a terminal, lines otherwise, nothing when `silent`.
    pub(crate) fn new(silent: bool) -> Self {
        if silent {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines(Mutex::new(Instant::now()));
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len}  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Bar(bar)
    }

    /// One analysis more.
    pub(crate) fn step(&self, p: &Progress) {
        let head = if p.passes > 1 { format!("pass {}/{}", p.pass, p.passes) } else { p.stage.to_owned() };
        let tail = format!("{} runs, {} workers", p.runs, p.workers);
        match self {
            Self::Silent => {}
            Self::Lines(last) => {
                let edge = p.step == 1 || p.step == p.steps;
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if edge || last.elapsed() > LINE_EVERY {
                    note(format_args!("{head}: {} of {} analyses, {tail}", p.step, p.steps));
                    *last = Instant::now();
                }
            }
            Self::Bar(bar) => {
                if bar.length() != Some(p.steps as u64) || p.step <= 1 {
                    bar.reset();
                    bar.set_length(p.steps as u64);
                }
                bar.set_prefix(head);
                bar.set_message(tail);
                bar.set_position(p.step as u64);
            }
        }
    }

    /// A line from the fleet that people should see.
    pub(crate) fn say(&self, text: &str) {
        match self {
            Self::Silent => {}
            Self::Lines(_) => note(format_args!("{text}")),
            Self::Bar(bar) => bar.suspend(|| note(format_args!("{text}"))),
        }
    }

    /// Clears the bar.
    pub(crate) fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
