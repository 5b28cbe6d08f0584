//! Progress: a bar on a terminal, plain lines elsewhere, records with `--log json`, nothing with `--json` alone; the same words on the
//! live page.
//!
//! Next file to read: [`told`], for what is said, then [`form`], for how it looks.

mod form;
mod told;

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use starlings_coordinator::fleet::FleetEvent;
use starlings_coordinator::infer;
use starlings_coordinator::live::{Live, Pace, Reach, Standing};
use starlings_coordinator::study::{Progress, Stage};

use form::Form;
use told::Told;

/// Time between two looks at the clock while nothing is told.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// How far the work was when it was last told of.
#[derive(Default)]
struct Known {
    pace: Pace,
    /// What was told then; nothing before the work begins and after it ends.
    told: Option<Told>,
    /// Share of the next batch that was done by then.
    share: f64,
}

/// Shows where a command stands.
pub(crate) struct Display {
    began: Instant,
    form: Form,
    known: Mutex<Known>,
    /// The live page, where there is one.
    live: OnceLock<Live>,
}

impl Display {
    /// Records with `--log json`; nothing when `silent`; a bar if standard error is a terminal, lines otherwise.
    pub(crate) fn new(silent: bool) -> Arc<Self> {
        let (form, known, live) = (Form::new(silent), Mutex::default(), OnceLock::new());
        let display = Arc::new(Self { began: Instant::now(), form, known, live });
        let shown = Arc::downgrade(&display);
        // Without it a long stage that tells nothing shows no time; nothing else depends on it.
        let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(move || {
            while let Some(display) = shown.upgrade() {
                display.look();
                drop(display);
                std::thread::sleep(LOOK_EVERY);
            }
        });
        display
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

    /// So much of the batch is done of which was told last.
    fn batch(&self, share: f64) {
        let mut known = self.known();
        if known.told.as_ref().is_some_and(|told| told.work().next > 0.0) && share < 1.0 {
            known.share = known.share.max(share);
            self.show(known, false);
        }
    }

    /// Time passes.
    fn look(&self) {
        self.show(self.known(), false);
    }

    /// One analysis more.
    pub(crate) fn step(&self, at: &Progress) {
        let is_edge = at.step == 1 || at.step == at.steps;
        let is_another = |before: Option<&Told>| before.is_none_or(|before| before.stage() != at.stage);
        self.tell(Told::Step(at.clone()), |before| is_edge || at.is_after_fit() && is_another(before));
    }

    /// A command goes on whose work has stages: each is told once, and where it stands now and then.
    pub(crate) fn stage(&self, at: &Stage) {
        self.tell(Told::Stage(at.clone()), |before| before.is_none_or(|before| before.is_another(at)));
    }

    /// An inference goes on.
    pub(crate) fn blocks(&self, at: &infer::Progress) {
        let is_first = |before: Option<&Told>| before.is_none_or(|before| before.stage() != at.stage);
        self.tell(Told::Blocks(at.clone()), is_first);
    }

    fn tell(&self, told: Told, is_edge: impl FnOnce(Option<&Told>) -> bool) {
        let mut known = self.known();
        let is_edge = is_edge(known.told.as_ref());
        let told = told.after(known.told.take());
        (known.share, known.told) = (0.0, Some(told));
        self.show(known, is_edge);
    }

    /// Shows what is known now; at once at an edge of a stage.
    fn show(&self, mut known: MutexGuard<'_, Known>, is_edge: bool) {
        let Some(standing) = known.at(self.began.elapsed().as_secs_f64()) else { return };
        if let Some(told) = &known.told {
            self.form.show(&standing, is_edge, |said| told.record(&standing, said));
        }
        let has_stages = matches!(known.told, Some(Told::Stage(_) | Told::Blocks(_)));
        drop(known);
        match self.live.get() {
            Some(live) if has_stages => live.stage(standing),
            Some(live) => live.stands(standing),
            None => {}
        }
    }

    /// A line from the fleet that people should see.
    pub(crate) fn say(&self, text: &str) {
        self.form.say(text);
    }

    /// Clears the bar.
    pub(crate) fn finish(&self) {
        self.known().told = None;
        self.form.finish();
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    /// Where the work stands at this time, s.
    fn at(&mut self, now_s: f64) -> Option<Standing> {
        let told = self.told.as_ref()?;
        let Reach { share, left_s } = self.pace.at(now_s, &told.work().with_batch(self.share));
        Some(Standing { share, left_s, ..told.in_words() })
    }
}
