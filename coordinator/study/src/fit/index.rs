//! Which analysis an ensemble is for.
//!
//! Next file to read: [`super::runner`].

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
