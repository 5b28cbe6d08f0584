//! The training span of a record: none where it is held out, all of it without `train`.
//!
//! Next file to read: [`super::start`].

use super::Refused;
use crate::file::RecordSection;
use crate::problem::Source;

/// The training span, `None` when the whole record is held out.
pub(super) fn span(
    source: &Source,
    section: &RecordSection,
    times: &[f64],
) -> Result<Option<[f64; 2]>, Refused> {
    match &section.train {
        Some(train) if section.held_out => {
            let help = "remove `train`, or remove `use = \"held-out\"`";
            source.report_with(train.span(), "a record that is held out has no training span", help);
            Err(Refused)
        }
        None if section.held_out => Ok(None),
        None => Ok(Some([f64::NEG_INFINITY, f64::INFINITY])),
        Some(train) => {
            let [from, to] = *train.get_ref();
            if times.iter().any(|t| from <= *t && *t <= to) {
                return Ok(Some([from, to]));
            }
            let (first, last) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
            source.report_with(
                train.span(),
                format!(
                    "no sample of record `{}` lies in the training span [{from}, {to}]",
                    section.name.get_ref()
                ),
                format!("its times run from {first} to {last}"),
            );
            Err(Refused)
        }
    }
}

/// A training span that ends so far behind the record that it is hardly meant.
pub(super) fn reaches_beyond(section: &RecordSection, times: &[f64]) -> Option<String> {
    let [_, to] = *section.train.as_ref()?.get_ref();
    let (first, last) = (*times.first()?, *times.last()?);
    (to.is_finite() && last > first && to > last + (last - first)).then(|| {
        format!(
            "`train` of record `{}` ends at {to}, its samples at {last}: nothing behind it is held out. Are both in the study's `time_unit`?",
            section.name.get_ref()
        )
    })
}
