//! Follows a recording row by row: estimates, and an alarm when the last steps no longer fit them.
//!
//! Rows are gathered in blocks; the last blocks are the recent window, and blocks that leave it join the reference, so that a change
//! is compared with what was before it. The reference is estimated anew when it has grown by a hundredth. A change too small for the
//! recent window is found by longer stretches, each against what came before it (`history.rs`); all tests of a block share the rate of
//! false alarms (Bonferroni). Read next: `change.rs`, the test.

use std::sync::Arc;

use super::history::History;
use super::sums::MOST;
use super::{
    Basis, Change, Fit, InferenceError, Memory, Posterior, Stream, StreamState, Structure, Sums, Window,
    compare,
};

/// How a recording is followed.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Following {
    /// Steps of a block: the detector answers once a block.
    pub block: u64,
    /// Blocks of the recent window.
    pub recent: usize,
    /// Memory of the reference.
    pub reference: Memory,
    /// Steps of the reference before the first test.
    pub least: u64,
    /// Whether stretches of two, four, eight ... times as many blocks are tested too.
    pub longer: bool,
    /// Probability of a false alarm of the tests of one block, on average over blocks.
    pub rate: f64,
    /// Coefficients that are watched, all where it is empty.
    pub watched: Vec<usize>,
}

/// What the detector says after a block.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Report {
    /// Time of the last row.
    pub time: f64,
    /// When the stretch starts that was tested; of an alarm with longer stretches, when the change was.
    pub since: f64,
    /// The test, the most improbable one of this block.
    pub change: Change,
    /// Probability, at most, of such a test among those of a block without a change, of which each has so many as all have on average.
    pub by_chance: f64,
    /// Whether it is an alarm.
    pub alarm: bool,
}

/// A recording that is followed.
#[derive(Debug)]
pub struct Detector {
    stream: Stream,
    structure: Structure,
    fit: Fit,
    following: Following,
    recent: Window,
    reference: Window,
    /// What longer stretches are made of.
    history: Option<History>,
    posterior: Option<Posterior>,
    in_block: u64,
    /// Steps that joined the reference since it was estimated.
    unused: u64,
}

/// A detector between two rows.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct DetectorState {
    stream: StreamState,
    recent: Window,
    reference: Window,
    history: Option<History>,
    posterior: Option<Posterior>,
    in_block: u64,
    unused: u64,
}

/// Share of its steps by which the reference grows before it is estimated anew.
const GROWTH: f64 = 0.01;

impl Detector {
    /// A detector before the first row.
    ///
    /// # Errors
    /// `NotPositive` for the step or the rate.
    pub fn new(
        basis: Arc<Basis>,
        step: f64,
        structure: Structure,
        fit: Fit,
        following: Following,
    ) -> Result<Self, InferenceError> {
        if !(following.rate > 0.0 && following.rate < 1.0) {
            return Err(InferenceError::NotPositive {
                what: "the rate of false alarms",
                value: following.rate,
            });
        }
        Ok(Self {
            stream: Stream::new(basis, step)?,
            structure,
            fit,
            recent: Window::new(Memory::Sliding(following.recent)),
            reference: Window::new(following.reference),
            history: following.longer.then(|| History::new(following.reference)),
            following,
            posterior: None,
            in_block: 0,
            unused: 0,
        })
    }

    /// Takes the next row; a report when it ends a block and there is a reference to compare with.
    ///
    /// # Errors
    /// As for [`Stream::push`] and [`Fit::posterior`], less those that say that the reference is still too short.
    pub fn push(&mut self, time: f64, values: &[f64]) -> Result<Option<Report>, InferenceError> {
        let first = self.stream.n_row() == 0;
        self.stream.push(time, values)?;
        if !first {
            self.in_block += 1;
        }
        if self.in_block < self.following.block {
            return Ok(None);
        }
        self.in_block = 0;
        let block = self.stream.take()?;
        if let Some(history) = &mut self.history {
            history.push(block.clone())?;
        }
        if let Some(older) = self.recent.push(block)? {
            self.unused += older.n_step();
            self.reference.push(older)?;
            let used = self.posterior.as_ref().map_or(0, |p| p.n_step);
            if self.unused as f64 >= GROWTH * used as f64 {
                self.estimate()?;
            }
        }
        let Some((posterior, recent)) = self.posterior.as_ref().zip(self.recent.sums()) else {
            return Ok(None);
        };
        let mut change = compare(posterior, &recent, &self.structure, &self.following.watched)?;
        let mut since = recent.span().map_or(time, |[from, _]| from);
        let mut per_block = 1.0;
        if let Some(history) = &self.history {
            per_block += 2.0 / self.following.recent.max(1) as f64;
            for seam in history.due(self.following.recent) {
                if let Some((from, longer)) = self.behind(history, seam)
                    && longer.probability < change.probability
                {
                    (since, change) = (from, longer);
                }
            }
        }
        let by_chance = (per_block * change.probability).min(1.0);
        let alarm = by_chance < self.following.rate;
        if alarm {
            since = self.changed().unwrap_or(since);
        }
        Ok(Some(Report { time, since, change, by_chance, alarm }))
    }

    /// The estimate of the reference, `None` while it is too short.
    pub fn posterior(&self) -> Option<&Posterior> {
        self.posterior.as_ref()
    }

    /// The sums of the reference.
    pub fn reference(&self) -> Option<Sums> {
        self.reference.sums()
    }

    /// Takes what came since the change of a report as the new reference: the recent window, or the blocks since the change was where
    /// longer stretches are tested.
    ///
    /// # Errors
    /// As for [`Window::push`].
    pub fn accept(&mut self, report: &Report) -> Result<(), InferenceError> {
        let mut reference = Window::new(self.following.reference);
        match &mut self.history {
            Some(history) => {
                for piece in history.forget_before(report.since) {
                    reference.push(piece)?;
                }
                self.recent = Window::new(Memory::Sliding(self.following.recent));
            }
            None => {
                for block in self.recent.drain() {
                    reference.push(block)?;
                }
            }
        }
        self.reference = reference;
        self.posterior = None;
        self.estimate()
    }

    /// What it goes on from, in this program or another.
    ///
    /// # Errors
    /// As for [`Stream::state`].
    pub fn state(&mut self) -> Result<DetectorState, InferenceError> {
        Ok(DetectorState {
            stream: self.stream.state()?,
            recent: self.recent.clone(),
            reference: self.reference.clone(),
            history: self.history.clone(),
            posterior: self.posterior.clone(),
            in_block: self.in_block,
            unused: self.unused,
        })
    }

    /// Puts a new detector where another one was; basis, structure, fit and following are the same.
    ///
    /// # Errors
    /// As for [`Stream::resume`], [`Window::check`] and [`Posterior::check`]; `Damaged` where it has no longer stretches, or has them unasked.
    pub fn resume(mut self, state: DetectorState) -> Result<Self, InferenceError> {
        let basis = Arc::clone(self.stream.basis());
        if state.in_block.max(state.unused) > MOST {
            return Err(InferenceError::Damaged { what: "the number of steps in a block" });
        }
        state.recent.check(&basis)?;
        state.reference.check(&basis)?;
        if state.history.is_some() != self.history.is_some() {
            return Err(InferenceError::Damaged { what: "the history of a recording" });
        }
        state.history.as_ref().map_or(Ok(()), |history| history.check(&basis))?;
        state.posterior.as_ref().map_or(Ok(()), |p| p.check(&self.structure))?;
        self.stream = Stream::resume(basis, state.stream)?;
        (self.recent, self.reference, self.history) = (state.recent, state.reference, state.history);
        (self.posterior, self.in_block, self.unused) = (state.posterior, state.in_block, state.unused);
        Ok(self)
    }

    /// When what lies behind a seam begins, and its test against what lies before. Too few steps before a seam, or functions that are
    /// not seen there, say nothing of it.
    fn behind(&self, history: &History, seam: usize) -> Option<(f64, Change)> {
        let (before, after) = history.parts(seam)?;
        if before.n_step() < self.following.least {
            return None;
        }
        let reference = match &self.posterior {
            Some(near) => self.fit.update(&before, &self.structure, near),
            None => self.fit.posterior(&before, &self.structure),
        };
        let change = compare(&reference.ok()?, &after, &self.structure, &self.following.watched).ok()?;
        Some((after.span()?[0], change))
    }

    /// When the coefficients changed: the seam with the largest square of the score of what lies behind it.
    fn changed(&self) -> Option<f64> {
        let history = self.history.as_ref()?;
        let tests = history.seams().filter_map(|seam| self.behind(history, seam));
        let most = tests.max_by(|(_, a), (_, b)| a.statistic.total_cmp(&b.statistic));
        most.map(|(since, _)| since)
    }

    fn estimate(&mut self) -> Result<(), InferenceError> {
        let Some(sums) = self.reference.sums().filter(|s| s.n_step() >= self.following.least) else {
            return Ok(());
        };
        let found = match &self.posterior {
            Some(earlier) => self.fit.update(&sums, &self.structure, earlier),
            None => self.fit.posterior(&sums, &self.structure),
        };
        match found {
            Ok(posterior) => {
                self.posterior = Some(posterior);
                self.unused = 0;
            }
            Err(InferenceError::TooFew { .. } | InferenceError::NothingObserved) => {}
            Err(other) => return Err(other),
        }
        Ok(())
    }
}
