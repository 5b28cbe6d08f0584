//! What a run of the study may cost, and whether a delay alone costs more.
//!
//! What depends on a run, such as the step length of a stiff model, is checked by the trial run: see [`crate::trial`].

use starlings_models::limits::MAX_STEPS;
use starlings_models::{BuildSetup, Memory, SOLVER, Setup};
use toml::Spanned;

use super::blame::expressions;
use crate::checked::Record;
use crate::file::StudyFile;
use crate::problem::Source;
use crate::variant::reads_past;

/// The limit of steps that the study sets, if any; one out of range is reported.
pub(super) fn max_steps(source: &Source, file: &StudyFile) -> Option<u64> {
    let given = file.model.max_steps.as_ref()?;
    let (message, help) = if file.model.kind.get_ref() == SOLVER {
        ("a solver counts its own steps", "remove `max_steps`; `timeout` limits the wall time of a run")
    } else if *given.get_ref() == 0 {
        ("a run takes at least one step", "give the steps that one run may take at most")
    } else {
        return Some(*given.get_ref());
    };
    source.report_with(given.span(), message, help);
    None
}

/// The limit of computing time that the study sets for a model that is no solver, if any; one out of range is reported.
pub(super) fn timeout(source: &Source, file: &StudyFile) -> Option<f64> {
    file.model.timeout.as_ref().map(|given| seconds(source, "timeout", given))
}

/// A time of the study in seconds; one out of range is reported.
pub(super) fn seconds(source: &Source, key: &str, given: &Spanned<f64>) -> f64 {
    let found = *given.get_ref();
    if !(found > 0.0 && found <= 3.2e9) {
        let message = format!("`{key}` must be above zero and at most 3.2e9 s, found {found}");
        source.report(given.span(), message);
    }
    found
}

/// Refuses a record over which a delay of a state or an output would take too many steps: a run steps from one sample of what is
/// remembered to the next, whatever the tolerance.
pub(super) fn check_delays(source: &Source, file: &StudyFile, setup: &Setup, records: &[Record]) {
    let Ok(model) = setup.model() else { return };
    let most = setup.max_steps.unwrap_or(MAX_STEPS);
    let length = |record: &Record| record.times.last().map(|last| last - record.start);
    let spans = records.iter().filter_map(|record| Some((record, length(record)?)));
    let Some((record, length)) = spans.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    for Memory { of, longest } in model.memories() {
        let steps = length / Memory { of: of.clone(), longest: *longest }.spacing();
        if steps > most as f64 {
            let mut places = expressions(file).into_iter().filter(|text| reads_past(text.get_ref()));
            let place = places.find(|text| text.get_ref().contains(&**of));
            source.report_with(
                place.map_or(file.model.kind.span(), Spanned::span),
                format!(
                    "the delay of `{of}` is at most {longest:e} {unit}: over the {length} {unit} of record `{}` a run would take \
                     {steps:.1e} steps, more than {most}",
                    record.name,
                    unit = file.study.time_unit,
                ),
                "leave a delay out that is so short, or allow more with `max_steps` in `[model]`",
            );
        }
    }
}
