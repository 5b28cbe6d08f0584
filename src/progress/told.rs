//! What is told of a command's work, in words.
//!
//! Next file to read: [`super::form`].

use starlings_coordinator::infer;
use starlings_coordinator::live::{Counted, Standing};
use starlings_coordinator::study::{Progress, Stage, Work};

use crate::log;

/// What was told last.
pub(super) enum Told {
    /// Of a run: passes and analyses.
    Step(Progress),
    /// Of a command whose work has stages.
    Stage(Stage),
    /// Of an inference.
    Blocks(infer::Progress),
}

impl Told {
    /// How much of the work is done.
    pub(super) fn work(&self) -> &Work {
        match self {
            Self::Step(at) => &at.work,
            Self::Stage(at) => &at.work,
            Self::Blocks(at) => &at.work,
        }
    }

    /// Name of the stage.
    pub(super) fn stage(&self) -> &str {
        match self {
            Self::Step(at) => at.stage,
            Self::Stage(at) => at.name,
            Self::Blocks(at) => at.stage,
        }
    }

    /// Whether a stage is another one than this, or says something else.
    pub(super) fn is_another(&self, at: &Stage) -> bool {
        self.stage() != at.name
            || matches!(self, Self::Stage(before) if !at.says.is_empty() && before.says != at.says)
    }

    /// What is told after this: a stage that goes on says what it said.
    pub(super) fn after(self, before: Option<Self>) -> Self {
        match (self, before) {
            (Self::Stage(at), Some(Self::Stage(before))) if at.says.is_empty() && at.name == before.name => {
                Self::Stage(Stage { says: before.says, ..at })
            }
            (told, _) => told,
        }
    }

    /// In words; how much of it is done is for others to say.
    pub(super) fn in_words(&self) -> Standing {
        match self {
            Self::Step(at) => Standing {
                stage: at.title(),
                says: at.says(),
                runs: at.runs,
                workers: at.workers,
                ..Standing::default()
            },
            Self::Stage(at) => Standing {
                stage: at.name.to_owned(),
                says: at.says.clone(),
                runs: at.runs,
                workers: at.workers,
                ..Standing::default()
            },
            Self::Blocks(at) => Standing {
                stage: at.stage.to_owned(),
                says: at.says.clone(),
                runs: at.n_block,
                counted: Counted::Blocks,
                workers: at.workers,
                ..Standing::default()
            },
        }
    }

    /// A record of it for programs.
    pub(super) fn record(&self, standing: &Standing, said: &str) {
        match self {
            Self::Step(at) => log::step(at, standing, said),
            Self::Stage(at) => log::stage(at, standing, said),
            Self::Blocks(at) => log::blocks(at, standing, said),
        }
    }
}
