//! Whether the estimator can let a state walk, and the study says all that takes.
//!
//! Next file to read: [`crate::fit::filter`].

use starlings_models::Spec;
use toml::Spanned;

use crate::checked::{Record, StudyParameter};
use crate::file::StudyFile;
use crate::plan::training_rows;
use crate::problem::Source;
use starlings_estimators::{Drift, Transform};

/// Reports walks of states that cannot be.
pub(crate) fn check(
    source: &Source,
    file: &StudyFile,
    (parameters, records): (&[StudyParameter], &[Record]),
    (spec, is_filter): (&Spec, bool),
) {
    for parameter in parameters.iter().filter(|p| p.is_initial() && matches!(p.drift, Drift::Walk(_))) {
        let section = file.parameters.iter().find(|section| *section.name.get_ref() == parameter.name);
        let Some(place) = section.and_then(|section| section.process.walk.as_ref()).map(Spanned::span) else {
            continue;
        };
        if let Some((message, help)) = fault(parameter, records, spec, is_filter) {
            source.report_with(place, message, help);
        }
    }
}

fn fault(
    parameter: &StudyParameter,
    records: &[Record],
    spec: &Spec,
    is_filter: bool,
) -> Option<(String, &'static str)> {
    let name = &parameter.name;
    if !is_filter {
        let message =
            format!("a state cannot walk in a batch fit, whose runs go through whole records: `{name}`");
        return Some((message, "take `kind = \"roukf\"` in `[estimator]`, or remove `process`"));
    }
    if !spec.restart {
        let message =
            format!("`{name}` cannot walk: `{}` does not go on from a state that it is given", spec.kind);
        return Some((message, "remove `process`; a parameter may walk"));
    }
    if !matches!(parameter.transform, Transform::Linear) {
        let message = format!("a state walks in its own unit, and the prior of `{name}` is not linear");
        return Some((message, "write `transform = \"linear\"` with an `sd`"));
    }
    let trained: Vec<&Record> = records.iter().filter(|record| record.is_trained()).collect();
    if !parameter.per_record && trained.len() > 1 {
        let message = format!("`{name}` is one value for all records, and the state of each walks by itself");
        return Some((message, "remove `per_record = false`"));
    }
    let mut counts = trained.iter().map(|record| analyses(record));
    let first = counts.next()?;
    counts.any(|count| count != first).then(|| {
        let message =
            format!("`{name}` walks at every analysis, and the records have different numbers of them");
        (message, "fit records of equal length, or each in a study of its own")
    })
}

/// Analyses of a record, as many as it has windows.
fn analyses(record: &Record) -> usize {
    let rows = training_rows(record);
    let alone =
        usize::from(rows.first() == Some(&0) && record.times.first().is_some_and(|t| record.start >= *t));
    alone + (rows.len() - alone).div_ceil(record.every)
}
