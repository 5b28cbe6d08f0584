//! Whether the estimator can let states walk, and the study says all that takes.
//!
//! Where one walks, the entries of all initial values follow their states: what is asked of one is asked of all. Next file to read:
//! [`crate::fit::filter`].

use std::collections::HashMap;
use std::ops::Range;

use starlings_estimators::Transform;
use toml::Spanned;

use crate::Study;
use crate::checked::StudyParameter;
use crate::file::StudyFile;
use crate::problem::Source;

/// Where the file says of each parameter how it moves, or else its name.
pub(super) fn places(file: &StudyFile) -> HashMap<String, Range<usize>> {
    let place = |section: &crate::file::ParameterSection| {
        let walk = section.process.walk.as_ref().map(Spanned::span);
        (section.name.get_ref().clone(), walk.unwrap_or_else(|| section.name.span()))
    };
    file.parameters.iter().map(place).collect()
}

/// Reports walks of states that cannot be; `predicted` is where the file asks for predictions.
pub(super) fn check(
    source: &Source,
    places: &HashMap<String, Range<usize>>,
    predicted: Range<usize>,
    study: &Study,
) {
    if !study.walks() {
        return;
    }
    for parameter in study.parameters.iter().filter(|p| p.is_initial()) {
        if let Some((message, help)) = fault(parameter, study) {
            source.report_with(places.get(&parameter.name).cloned().unwrap_or_default(), message, help);
        }
    }
    if !study.predict.outputs.is_empty() {
        let message = "a state walks, so that the posterior has it at the end of the record, and what is predicted begins at its start";
        source.report_with(predicted, message, "remove `process` of the initial values, or `[predict]`");
    }
}

fn fault(parameter: &StudyParameter, study: &Study) -> Option<(String, &'static str)> {
    let name = &parameter.name;
    if !study.estimator.kind.is_filter() {
        let message =
            format!("a state cannot walk in a batch fit, whose runs go through whole records: `{name}`");
        return Some((message, "take `kind = \"roukf\"` in `[estimator]`, or remove `process`"));
    }
    if !study.spec.restart {
        let message = format!(
            "`{name}` cannot walk: `{}` does not go on from a state that it is given",
            study.spec.kind
        );
        return Some((message, "remove `process`; a parameter may walk"));
    }
    if !matches!(parameter.transform, Transform::Linear) {
        let message = format!("a state walks in its own unit, and the prior of `{name}` is not linear");
        return Some((message, "write `transform = \"linear\"` with an `sd`"));
    }
    let trained: Vec<usize> = (0..study.records.len()).filter(|r| study.records[*r].is_trained()).collect();
    if !parameter.per_record && trained.len() > 1 {
        let message = format!("`{name}` is one value for all records, and the state of each walks by itself");
        return Some((message, "remove `per_record = false`"));
    }
    let mut counts = trained.iter().map(|record| study.windows(*record).len());
    let first = counts.next()?;
    counts.any(|count| count != first).then(|| {
        let message =
            format!("`{name}` walks at every analysis, and the records have different numbers of them");
        (message, "fit records of equal length, or each in a study of its own")
    })
}
