//! Progress: a bar on a terminal, plain lines elsewhere, records with `--log json`, nothing with `--json` alone.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use starlings_coordinator::explain::Stage;
use starlings_coordinator::study::Progress;

use crate::console::note;
use crate::log;

/// Spacing of plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Spacing of records for programs.
const RECORD_EVERY: Duration = Duration::from_millis(250);

/// Spacing of the pictures of a spinner.
const TICK: Duration = Duration::from_millis(100);

/// The line that was shown last.
pub(crate) struct Last {
    at: Instant,
    /// Name of the stage, and what it said.
    stage: Option<(&'static str, String)>,
}

/// Shows where a run stands.
pub(crate) enum Display {
    /// Nothing is shown.
    Silent,
    /// A line now and then, the first and the last of a pass always.
    Lines(Mutex<Last>),
    /// Records for programs, a few a second; the time of the last one.
    Records(Mutex<Option<Instant>>),
    /// A bar.
    Bar(ProgressBar),
}

impl Display {
    /// Records with `--log json`; nothing when `silent`; a bar if standard error is a terminal, lines otherwise.
    pub(crate) fn new(silent: bool) -> Self {
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
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len}  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Bar(bar)
    }

    /// One analysis more.
    pub(crate) fn step(&self, p: &Progress) {
        let head = match p.passes {
            None => format!("pass {}", p.pass),
            Some(passes) if passes > 1 => format!("pass {}/{passes}", p.pass),
            Some(_) => p.stage.to_owned(),
        };
        let tail = format!("{} runs, {} workers", p.runs, p.workers);
        match self {
            Self::Lines(last) => {
                let edge = p.step == 1 || p.step == p.steps;
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if edge || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{head}: {} of {} analyses, {tail}", p.step, p.steps));
                    last.at = Instant::now();
                }
            }
            Self::Records(last) if p.step == 1 || p.step == p.steps || is_due(last) => {
                log::step(p, &format!("{head}: {} of {} analyses, {tail}", p.step, p.steps));
            }
            Self::Silent | Self::Records(_) => {}
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

    /// An explanation goes on: each stage is told once, and where it stands now and then.
    pub(crate) fn stage(&self, stage: &Stage) {
        let says = if stage.says.is_empty() { String::new() } else { format!("{}, ", stage.says) };
        let tail = format!("{says}{} runs, {} workers", stage.runs, stage.workers);
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                let told = |(name, says): &(&str, String)| {
                    *name == stage.name && (stage.says.is_empty() || *says == stage.says)
                };
                let new = !last.stage.as_ref().is_some_and(told);
                if new || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("{}: {tail}", stage.name));
                    last.at = Instant::now();
                    last.stage = Some((stage.name, stage.says.clone()));
                }
            }
            Self::Records(last) if is_due(last) => log::stage(stage, &format!("{}: {tail}", stage.name)),
            Self::Silent | Self::Records(_) => {}
            Self::Bar(bar) => {
                if bar.prefix() != stage.name {
                    let spinner = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg} {elapsed}");
                    bar.set_style(spinner.unwrap_or_else(|_| ProgressStyle::default_spinner()));
                    bar.set_prefix(stage.name);
                    bar.enable_steady_tick(TICK);
                }
                bar.set_message(tail);
            }
        }
    }

    /// An inference goes on.
    pub(crate) fn blocks(&self, at: &starlings_coordinator::infer::Progress) {
        let says = format!("{} blocks, {} steps", at.n_block, at.n_step);
        match self {
            Self::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if at.n_block == 1 || last.at.elapsed() > LINE_EVERY {
                    note(format_args!("sums: {says}, {} workers", at.workers));
                    last.at = Instant::now();
                }
            }
            Self::Records(last) if at.n_block == 1 || is_due(last) => {
                log::blocks(at, &format!("sums: {says}, {} workers", at.workers));
            }
            Self::Silent | Self::Records(_) => {}
            Self::Bar(bar) => {
                if bar.prefix() != "sums" {
                    let spinner = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg} {elapsed}");
                    bar.set_style(spinner.unwrap_or_else(|_| ProgressStyle::default_spinner()));
                    bar.set_prefix("sums");
                    bar.enable_steady_tick(TICK);
                }
                bar.set_message(format!("{says}, {} workers", at.workers));
            }
        }
    }

    /// A line from the fleet that people should see.
    pub(crate) fn say(&self, text: &str) {
        match self {
            Self::Silent => {}
            Self::Lines(_) | Self::Records(_) => note(format_args!("{text}")),
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

/// Whether the last record was told long enough ago; then another one is told now.
fn is_due(last: &Mutex<Option<Instant>>) -> bool {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    let is_due = last.is_none_or(|at| at.elapsed() > RECORD_EVERY);
    if is_due {
        *last = Some(Instant::now());
    }
    is_due
}
