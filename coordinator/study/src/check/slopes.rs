//! Whether the model gives the derivatives that an estimator asks of it.
//!
//! Next file to read: [`super::walks`].

use std::ops::Range;

use starlings_models::{BuildSetup, SOLVER};
use toml::Spanned;

use crate::Study;
use crate::file::EstimatorSection;
use crate::problem::Source;

/// Where a file names its estimator.
pub(super) fn place(section: &EstimatorSection) -> Option<Range<usize>> {
    section.kind.as_ref().map(Spanned::span)
}

/// Refuses an estimator with exact slopes where there are none. `kind` is where the file names it.
pub(super) fn check(source: &Source, kind: Option<Range<usize>>, study: &Study) {
    let (Some(kind), true) = (kind, study.estimator.kind.has_exact_slopes()) else { return };
    // A solver was refused by its name.
    if study.setup.model.kind == SOLVER {
        return;
    }
    let help = "use kind = \"batch\", whose sigma points stand for derivatives";
    if let Some(record) = study.records.iter().find(|record| record.surfaces().next().is_some()) {
        let message =
            format!("derivatives of distances to a surface are not to be had (record `{}`)", record.name);
        return source.report_with(kind, message, help);
    }
    if let Err(error) = study.with_slopes().build() {
        source.report_with(kind, error.to_string(), help);
    }
}
