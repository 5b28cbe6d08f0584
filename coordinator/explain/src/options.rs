//! What an explanation is asked for, what it needs from the outside, what it returns, and why it may end without an answer.
//!
//! Next file to read: [`super::result`].

use std::sync::mpsc::Receiver;

use starlings_estimators::EstimatorError;
use starlings_fleet::{FleetError, FleetEvent};
use starlings_models::SetupError;
use starlings_study::store::StoreError;
use starlings_study::{RunError, Study};

use super::laboratory::HOLD;
use super::{Explanation, Figures};

/// What was asked for besides the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Runs of the model at most; `None` takes the study's own budget, or no limit.
    pub budget: Option<u64>,
    /// Effects that are not to be tried, by name.
    pub without: Vec<String>,
    /// Effects to try; empty for all.
    pub only: Vec<String>,
    /// Go on although the fit of the model as it is has not converged.
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
    /// What the study itself asks for.
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

/// Where an explanation stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// `fit`, `locate`, `screen`, `refit`, `gates`, `verdict`, `add`, `show` or `null`.
    pub name: &'static str,
    /// What is being done, in a few words.
    pub says: String,
    /// Runs so far.
    pub runs: u64,
    /// Workers now.
    pub workers: usize,
}

/// What an explanation needs from the outside: time, somebody who watches, and the fleet's events.
pub struct Context<'a> {
    /// Seconds since the program started.
    pub clock: &'a dyn Fn() -> f64,
    /// Called at the start of every stage and after every batch of runs.
    pub watch: &'a mut dyn FnMut(&Stage),
    /// Events of the fleet, kept in the store.
    pub events: Option<&'a Receiver<FleetEvent>>,
    /// Wall time of the earlier parts of a resumed explanation, in s.
    pub earlier_s: f64,
}

/// An explanation with what its report draws and the study that it proposes.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The explanation.
    pub explanation: Explanation,
    /// The data of the report's figures.
    pub figures: Figures,
    /// Text of the study with the effects in it, when something was added.
    pub explained_study: Option<String>,
}

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// The fleet failed as a whole.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A run has no usable answer, and that is not the model's doing.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A step of the arithmetic could not be done.
    #[error(transparent)]
    Estimator(#[from] EstimatorError),
    /// The model with an effect does not build although it was checked.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// There is nothing to try.
    #[error("{0}")]
    NothingToTry(String),
    /// The fit of the model as it is did not converge.
    #[error(
        "the fit of the model as it is has not converged after {iterations} iterations: it stands at {stand}; improve priors \
         or initial values, or go on from there with --force"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Where it stands, in words.
        stand: String,
    },
    /// The model as it is cannot be run at all.
    #[error("the model as it is fails at its prior median: {0}")]
    Baseline(String),
    /// The budget does not even suffice for the fit and one run of what was fitted.
    #[error("the budget of {budget} runs ended during the {stage}: {needed} more would be needed")]
    Budget {
        /// The budget.
        budget: u64,
        /// The stage.
        stage: &'static str,
        /// Runs that were asked for.
        needed: u64,
    },
    /// A name that is not among the candidates.
    #[error("{0}")]
    Name(String),
    /// A noise that has nothing to do with the values it belongs to.
    #[error("{0}")]
    Noise(String),
}

impl ExplainError {
    /// Whether somebody cancelled the work, rather than that it failed.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Fleet(error) => matches!(error, FleetError::Cancelled),
            Self::Run(error) => error.is_cancelled(),
            _ => false,
        }
    }

    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::NothingToTry(_)
                | Self::NotConverged { .. }
                | Self::Name(_)
                | Self::Noise(_)
                | Self::Baseline(_)
                | Self::Budget { .. }
        )
    }
}
