//! Progress: a bar on a terminal, plain lines elsewhere, records with `--log json`, nothing with `--json` alone; the same words on the
//! live page.
//!
//! Next file to read: [`form`], for how each of them looks.

mod form;

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use starlings_coordinator::explain::Stage;
use starlings_coordinator::fleet::FleetEvent;
use starlings_coordinator::live::{Live, Pace, Standing};
use starlings_coordinator::study::{Progress, Work};

use crate::log;
use form::Form;

/// How far the work was when it was last told of.
#[derive(Default)]
struct Known {
    pace: Pace,
    work: Work,
    /// What was said then.
    standing: Standing,
}

/// Shows where a command stands.
pub(crate) struct Display {
    began: Instant,
    form: Form,
    pace: Mutex<Known>,
    /// The live page, where there is one.
    live: OnceLock<Live>,
}

impl Display {
    /// Records with `--log json`; nothing when `silent`; a bar if standard error is a terminal, lines otherwise.
    pub(crate) fn new(silent: bool) -> Self {
        Self { began: Instant::now(), form: Form::new(silent), pace: Mutex::default(), live: OnceLock::new() }
    }

    /// Seconds since it began.
    pub(crate) fn clock(&self) -> Arc<dyn Fn() -> f64 + Send + Sync> {
        let began = self.began;
        Arc::new(move || began.elapsed().as_secs_f64())
    }

    /// Shows everything on a live page too.
    pub(crate) fn show_on(&self, live: Live) {
        // A command has one.
        let _ = self.live.set(live);
    }

    /// The fleet tells something.
    pub(crate) fn heard(&self, event: &FleetEvent) {
        if let Some(live) = self.live.get() {
            live.event(event);
        }
        if let FleetEvent::Progress { done, total } = event {
            self.batch(*done as f64 / (*total).max(1) as f64);
        }
    }

    /// So much of the batch is done of which the last step told.
    fn batch(&self, share: f64) {
        let mut known = lock(&self.pace);
        if known.work.total > 0.0 && share < 1.0 {
            let work = known.work;
            let standing = known.at(self.began.elapsed().as_secs_f64(), work.done + share * work.next);
            drop(known);
            self.form.batch(&standing);
            if let Some(live) = self.live.get() {
                live.stands(standing);
            }
        }
    }

    /// One analysis more.
    pub(crate) fn step(&self, p: &Progress) {
        let stage = match p.passes {
            None => format!("pass {}", p.pass),
            Some(passes) if passes > 1 => format!("pass {}/{passes}", p.pass),
            Some(_) => p.stage.to_owned(),
        };
        let (stage, says) = if p.is_analysis() {
            (stage, format!("{} of {} analyses", p.step, p.steps))
        } else {
            (p.stage.to_owned(), format!("{} of {} ensembles after the fit", p.step, p.steps))
        };
        let (runs, workers) = (p.runs, p.workers);
        let mut known = lock(&self.pace);
        known.work = p.work;
        known.standing = Standing { stage, says, share: None, left_s: None, runs, workers };
        let standing = known.at(self.began.elapsed().as_secs_f64(), p.work.done);
        drop(known);
        self.form.step(&standing, p);
        if let Some(live) = self.live.get() {
            live.stands(standing);
        }
    }

    /// An explanation goes on: each stage is told once, and where it stands now and then.
    pub(crate) fn stage(&self, stage: &Stage) {
        let standing = Standing {
            stage: stage.name.to_owned(),
            says: stage.says.clone(),
            share: None,
            left_s: None,
            runs: stage.runs,
            workers: stage.workers,
        };
        self.form.stage(&standing, |said| log::stage(stage, said));
        if let Some(live) = self.live.get() {
            live.stage(standing);
        }
    }

    /// An inference goes on.
    pub(crate) fn blocks(&self, at: &starlings_coordinator::infer::Progress) {
        let standing = Standing {
            stage: "sums".to_owned(),
            says: format!("{} blocks, {} steps", at.n_block, at.n_step),
            share: None,
            left_s: None,
            runs: at.n_block,
            workers: at.workers,
        };
        self.form.blocks(&standing, at);
        if let Some(live) = self.live.get() {
            live.stands(standing);
        }
    }

    /// A line from the fleet that people should see.
    pub(crate) fn say(&self, text: &str) {
        self.form.say(text);
    }

    /// Clears the bar.
    pub(crate) fn finish(&self) {
        self.form.finish();
    }
}

impl Known {
    /// Where the work stands with so much of it done at this time, s.
    fn at(&mut self, now_s: f64, done: f64) -> Standing {
        let total = self.work.total;
        let left_s = self.pace.left(now_s, done, total);
        let share = (total > 0.0).then(|| (done / total).clamp(0.0, 1.0));
        Standing { share, left_s, ..self.standing.clone() }
    }
}

fn lock(known: &Mutex<Known>) -> MutexGuard<'_, Known> {
    known.lock().unwrap_or_else(PoisonError::into_inner)
}
