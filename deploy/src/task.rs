//! One process of a deployment, as its engine tells it.

use std::fmt;

use serde::Serialize;

/// What a process is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The coordinator.
    Coordinator,
    /// A worker, by its number from zero.
    Worker(usize),
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coordinator => f.write_str("coordinator"),
            Self::Worker(i) => write!(f, "worker {i}"),
        }
    }
}

impl Role {
    /// Name of its log in the folder `logs` of a deployment.
    pub fn log(self) -> String {
        match self {
            Self::Coordinator => "coordinator.log".to_owned(),
            Self::Worker(i) => format!("worker-{i}.log"),
        }
    }

    /// Name of the file beside it in which its script says which process it is.
    pub(crate) fn process(self) -> String {
        match self {
            Self::Coordinator => "coordinator.process".to_owned(),
            Self::Worker(i) => format!("worker-{i}.process"),
        }
    }
}

/// Where a process stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// In the queue.
    Waiting,
    /// Runs.
    Running,
    /// Is being ended.
    Ending,
    /// Ended by itself and in order.
    Done,
    /// Ended otherwise.
    Failed,
    /// Ended because somebody said so.
    Cancelled,
    /// The engine knows nothing of it.
    Unknown,
    /// Its machine does not answer: it may run or not.
    Unreached,
}

impl State {
    /// Whether the engine still holds or runs it.
    pub fn is_live(self) -> bool {
        matches!(self, Self::Waiting | Self::Running | Self::Ending)
    }

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Ending => "ending",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
            Self::Unknown => "gone",
            Self::Unreached => "unreached",
        }
    }
}

/// A process of a deployment.
#[derive(Clone, Debug, Serialize)]
pub struct Task {
    /// What it is for.
    pub role: Role,
    /// Its number in the engine.
    pub id: String,
    /// Where it stands.
    pub state: State,
    /// Since when, seconds since 1970, where the engine says so.
    pub since: Option<i64>,
    /// Where it runs or ran.
    pub node: Option<String>,
    /// Why it stands there, in the engine's own word.
    pub reason: Option<String>,
    /// The same in a sentence.
    pub says: Option<String>,
    /// How often it was started again.
    pub restarts: u32,
}

impl Task {
    /// A process of which the engine knows nothing.
    pub fn unknown(role: Role) -> Self {
        let says = "the engine does not know it any more, or never did".to_owned();
        Self {
            role,
            id: String::new(),
            state: State::Unknown,
            since: None,
            node: None,
            reason: None,
            says: Some(says),
            restarts: 0,
        }
    }
}
