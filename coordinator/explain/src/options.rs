//! The options of an explanation, and what it needs from outside: a clock, an observer of its progress, the fleet's events.
//!
//! Next file to read: [`super::error`].

use std::sync::mpsc::Receiver;

use starlings_fleet::FleetEvent;
use starlings_study::{Stage, Study};

/// Bytes of intermediate results of one kind that are held by default.
pub(crate) const HOLD: usize = 1 << 20;

/// What an explanation is asked for besides the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Runs of the model at most; `None` takes the study's own budget, or no limit.
    pub budget: Option<u64>,
    /// Effects that are not to be tried, by name.
    pub without: Vec<String>,
    /// Effects to try; empty for all.
    pub only: Vec<String>,
    /// Whether to continue although the fit of the model as it is has not converged.
    pub force: bool,
    /// Effects at most in one explanation.
    pub max_effects: usize,
    /// Simulated recordings without a gap on which the whole search measures its false alarms.
    pub nulls: usize,
    /// Bytes of intermediate results of one kind that are held at most: more takes less time where recordings are long, and no
    /// finding depends on it.
    pub hold: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            budget: None,
            without: Vec::new(),
            only: Vec::new(),
            force: false,
            max_effects: 2,
            nulls: 0,
            hold: HOLD,
        }
    }
}

impl Options {
    /// The options that the study file gives.
    pub fn of(study: &Study) -> Self {
        let asked = &study.explain;
        let default = Self::default();
        Self {
            budget: asked.budget,
            without: asked.without.clone(),
            only: asked.only.clone(),
            max_effects: asked.max_effects.unwrap_or(default.max_effects),
            ..default
        }
    }
}

/// What an explanation needs from outside: the time, an observer of its progress, and the fleet's events.
pub struct Context<'a> {
    /// Seconds since the program started.
    pub clock: &'a dyn Fn() -> f64,
    /// Called at the start of every stage, and before and after every batch of runs. Stages are `fit`, `locate`, `screen`, `refit`, `gates`,
    /// `verdict`, `add`, `show` and `null`.
    pub watch: &'a mut dyn FnMut(&Stage),
    /// Events of the fleet, kept in the store.
    pub events: Option<&'a Receiver<FleetEvent>>,
    /// Wall time of the earlier parts of a resumed explanation, in s.
    pub earlier_s: f64,
}
