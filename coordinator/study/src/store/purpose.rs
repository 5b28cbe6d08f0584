//! The command that a run folder belongs to: its database holds it, and the other command refuses the folder.

use super::{Store, StoreError};

/// Name under which the store keeps a finished explanation.
pub const EXPLANATION: &str = "explanation";

/// The command that a run folder belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// `starlings run`.
    Run,
    /// `starlings explain`.
    Explanation,
}

impl Purpose {
    /// Name under which the store keeps it.
    pub(super) const KEY: &'static str = "purpose";

    /// What the store holds under its key.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Explanation => EXPLANATION,
        }
    }

    /// What messages call it.
    pub(super) fn with_article(self) -> &'static str {
        match self {
            Self::Run => "a run",
            Self::Explanation => "an explanation",
        }
    }

    /// The command.
    pub(super) fn command(self) -> &'static str {
        match self {
            Self::Run => "starlings run",
            Self::Explanation => "starlings explain",
        }
    }

    /// Name under which the store keeps the result of the command once it is finished.
    pub(super) fn result(self) -> &'static str {
        match self {
            Self::Run => "summary",
            Self::Explanation => EXPLANATION,
        }
    }

    /// The files that the command writes beside its database.
    pub(super) fn files(self) -> &'static [&'static str] {
        match self {
            Self::Run => &["study.toml", "posterior.csv", "summary.json", "predicted.csv", "report.html"],
            Self::Explanation => &["study.toml", "explain.json", "explained.toml", "report.html"],
        }
    }

    /// What a store was made for; a run where it does not say.
    pub(super) fn of(store: &Store) -> Result<Self, StoreError> {
        let kept = store.meta(Self::KEY)?;
        Ok(if kept.as_deref() == Some(Self::Explanation.name()) { Self::Explanation } else { Self::Run })
    }
}
