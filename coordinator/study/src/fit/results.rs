//! What goes to a fleet and what comes back, by particle and window.
//!
//! Next file to read: [`super::runner`].

use std::sync::Arc;

use starlings_fleet::Held;
use starlings_models::{Failure, Prediction, Window};

/// The windows of one step, one per record that still has data: (record, window).
pub(crate) type StepWindows = Vec<(usize, Arc<Window>)>;

/// The analysis that an ensemble belongs to; goes into the rows of the store.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnalysisIndex {
    /// Pass, from 1; 0 for the final forward run.
    pub(crate) pass: usize,
    /// Analysis within the pass, from 0.
    pub(crate) step: usize,
}

impl AnalysisIndex {
    /// Whether a fit makes it, and not the forward run.
    pub(super) fn is_of_fit(self) -> bool {
        self.pass > 0
    }
}

/// A prediction per particle and window, or why there is none: a failure of the model, or the limit of wall time.
pub(crate) type Results = Vec<Vec<Predicted>>;

/// A prediction, or why there is none.
pub(crate) type Predicted = Result<Prediction<Held>, Failure>;
