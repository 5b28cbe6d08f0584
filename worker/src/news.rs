//! What a worker says to whoever watches it: a line whenever something changes.
//!
//! Next file to read: [`crate::session`].

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Something that changed.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// A coordinator has taken the worker.
    Connected {
        /// Name of its run.
        run: String,
        /// Where it is.
        address: String,
        /// Runs at the same time.
        slots: usize,
        /// Number of the connection.
        epoch: u64,
    },
    /// It came back to a run that it knew.
    Delivered {
        /// Results that it held.
        finished: usize,
        /// Runs that it goes on with.
        computing: usize,
    },
    /// Nobody answers yet.
    Waiting {
        /// Where it dials.
        address: String,
        /// What the last attempt said.
        last: String,
        /// For how long it goes on.
        left: Duration,
        /// The option that sets the wait.
        option: &'static str,
    },
    /// The coordinator let it go, and it waits for the next command.
    Stays {
        /// The coordinator's word.
        reason: String,
        /// For how long it waits.
        left: Duration,
    },
    /// It ends.
    Ended {
        /// Why.
        reason: String,
        /// Runs answered.
        answered: u64,
    },
    /// Jobs came after there were none.
    Working,
    /// There have been no jobs for a while.
    Idle {
        /// Runs answered so far.
        answered: u64,
    },
    /// The connection is gone, and it dials again.
    Lost {
        /// Why.
        reason: String,
        /// Runs that it goes on with meanwhile.
        computing: usize,
    },
    /// It and the coordinator see the same folder for states.
    Shares {
        /// The folder.
        place: String,
    },
    /// They do not, although it was named here and there.
    DoesNotShare {
        /// The folder, as it was named here.
        place: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The coordinator says something.
    Told(String),
}

impl News {
    /// A short name of the kind of news.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Connected { .. } => "connected",
            Self::Delivered { .. } => "delivered",
            Self::Waiting { .. } => "waiting",
            Self::Stays { .. } => "stays",
            Self::Ended { .. } => "ended",
            Self::Working => "working",
            Self::Idle { .. } => "idle",
            Self::Lost { .. } => "lost",
            Self::Shares { .. } => "shares-states",
            Self::DoesNotShare { .. } => "does-not-share-states",
            Self::Told(_) => "told",
        }
    }
}

impl fmt::Display for News {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Connected { run, address, slots, .. } => {
                let s = if *slots == 1 { "" } else { "s" };
                write!(f, "connected to {address} for the run `{run}`, {slots} slot{s}")
            }
            Self::Delivered { finished, computing } => {
                write!(
                    f,
                    "delivered {finished} results that were held; {computing} runs are still being made"
                )
            }
            Self::Waiting { address, last, left, option } => {
                let seconds = left.as_secs_f64().round();
                write!(
                    f,
                    "no coordinator at {address} yet ({last}): dialling for up to {seconds} s (`{option}` sets the wait)"
                )
            }
            Self::Stays { reason, left } => {
                let seconds = left.as_secs_f64().round();
                write!(
                    f,
                    "{reason}: waiting for the next command for up to {seconds} s (`--idle` sets the wait)"
                )
            }
            Self::Ended { reason, answered } => write!(f, "ends: {reason}; {answered} runs answered"),
            Self::Working => write!(f, "working"),
            Self::Idle { answered } => write!(f, "idle: no jobs, {answered} runs answered so far"),
            Self::Lost { reason, computing } => {
                write!(
                    f,
                    "lost the coordinator: {reason}; dialling again, {computing} runs go on and results are held"
                )
            }
            Self::Shares { place } => write!(f, "states go through {place}"),
            Self::DoesNotShare { place, reason } => {
                write!(f, "states go over the connection: {place} is not the coordinator's folder ({reason})")
            }
            Self::Told(text) => write!(f, "{text}"),
        }
    }
}

/// Takes news.
pub type Tell = Arc<dyn Fn(&News) + Send + Sync>;
