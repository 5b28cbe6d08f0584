//! Whether the model gives the derivatives that an estimator asks of it.
//!
//! Next file to read: [`super::walks`].

use std::ops::Range;

use starlings_models::{BuildSetup, SOLVER};

use crate::Study;
use crate::problem::Source;

/// Refuses an estimator with exact slopes where there are none. `kind` is where the file names it.
pub(super) fn check(source: &Source, kind: Option<Range<usize>>, study: &Study) {
    let (Some(kind), true) = (kind, study.estimator.kind.has_exact_slopes()) else { return };
    // A solver was refused by its name.
    if study.setup.model.kind == SOLVER {
        return;
    }
    if let Err(error) = study.with_slopes().build() {
        let help = "use kind = \"batch\", whose sigma points stand for derivatives";
        source.report_with(kind, error.to_string(), help);
    }
}
