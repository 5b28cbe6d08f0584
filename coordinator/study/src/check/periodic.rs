//! `start = "periodic"` of `[model]`: whether the model has such a start, and the period of every record.
//!
//! A period is given or found in the inputs, and refused where inputs or data do not repeat after it. Next file to read: [`repeats`].

mod repeats;

use starlings_models::BuildSetup;
use toml::Spanned;

use super::built::CheckedModel;
use crate::checked::Record;
use crate::expand::INITIAL;
use crate::file::StudyFile;
use crate::problem::Source;
use repeats::{channel_mismatch, found, has_left, input_mismatch, spacing};

/// Root mean square difference from one period to the next, over the range, that a period may leave in an input.
const NOT_PERIODIC: f64 = 0.1;

/// Samples of the inputs, in each period, to which the period is known.
const RESOLVED: f64 = 0.5;

/// The period of every record; empty where runs begin in the initial state, or a problem was reported.
pub(super) fn periods(
    source: &Source,
    file: &StudyFile,
    model: &CheckedModel,
    records: &[Record],
    warnings: &mut Vec<String>,
) -> Vec<f64> {
    let given = || file.records.iter().filter_map(|r| r.period.as_ref()).chain(&file.model.period);
    let start = file.model.start.as_ref().filter(|start| start.get_ref() != "initial");
    let Some(start) = start else {
        for period in given() {
            let help = "add `start = \"periodic\"` to `[model]`, or remove `period`";
            source.report_with(period.span(), "`period` is the length of a periodic start", help);
        }
        return Vec::new();
    };
    if start.get_ref() != "periodic" {
        let valid = ["initial".to_owned(), "periodic".to_owned()];
        source.report_unknown(start.span(), format!("unknown start `{}`", start.get_ref()), &valid);
        return Vec::new();
    }
    let mut sound = is_possible(source, file, model, start);
    for period in given().filter(|p| !(*p.get_ref() > 0.0 && p.get_ref().is_finite())) {
        source.report(period.span(), format!("`period` is {}: give a time above zero", period.get_ref()));
        sound = false;
    }
    if !sound {
        return Vec::new();
    }
    let of_record = |record: &Record| of_record(source, (file, model), record, start, warnings);
    records.iter().filter_map(of_record).collect()
}

/// Refuses models that have no periodic start, and initial values that one would not have.
fn is_possible(source: &Source, file: &StudyFile, model: &CheckedModel, start: &Spanned<String>) -> bool {
    let kind = &model.spec.kind;
    let remembers = model.setup.model().is_ok_and(|model| !model.memories().is_empty());
    let why = if !model.spec.restart {
        Some(format!("the model `{kind}` cannot go on from a state, so it has no periodic start"))
    } else if model.delays || remembers {
        Some(format!("the model `{kind}` has a delay: a periodic start would need its past"))
    } else if model.setup.is_noisy() {
        Some(format!("the states of the model `{kind}` have noise: no state returns to itself"))
    } else {
        None
    };
    let mut sound = why.is_none();
    if let Some(why) = why {
        source.report_with(
            start.span(),
            why,
            "remove `start`; a `start` of the record lets the model settle",
        );
    }
    for parameter in file.parameters.iter().filter(|p| p.name.get_ref().starts_with(INITIAL)) {
        let message = format!("a periodic start leaves nothing to `{}`", parameter.name.get_ref());
        source.report_with(parameter.name.span(), message, "remove it, or `start = \"periodic\"`");
        sound = false;
    }
    sound
}

fn of_record(
    source: &Source,
    (file, model): (&StudyFile, &CheckedModel),
    record: &Record,
    start: &Spanned<String>,
    warnings: &mut Vec<String>,
) -> Option<f64> {
    let section = file.records.iter().find(|section| *section.name.get_ref() == record.name)?;
    let Some(given) = section.period.as_ref().or(file.model.period.as_ref()) else {
        let known = found(&record.inputs, record.start);
        if known.is_none() {
            let message = if record.inputs.is_empty() {
                format!("the model `{}` has no inputs, in which a period would be found", model.spec.kind)
            } else {
                format!("no period is found in the inputs of record `{}`", record.name)
            };
            source.report_with(start.span(), message, "give `period`, in `[model]` or in the record");
        }
        return known;
    };
    let period = *given.get_ref();
    let end = record.start + period;
    for (input, signal) in model.spec.inputs.iter().zip(&record.inputs) {
        let last = signal.times.last().copied().unwrap_or(record.start);
        if last < end - 1e-9 * period {
            let message = format!(
                "input `{}` of record `{}` ends at {last}, before the first period does at {end}",
                input.name, record.name
            );
            source.report_with(given.span(), message, "give a shorter period, or inputs over a whole one");
            return None;
        }
    }
    if let Some(differs) = differing(model, record, period) {
        let message =
            format!("a period of {period} is none of the data of record `{}`: {differs}", record.name);
        let help = found(&record.inputs, record.start).map_or_else(
            || {
                "give the time after which inputs and data repeat, or remove `start = \"periodic\"`"
                    .to_owned()
            },
            |known| format!("its inputs repeat every {known:.6}; without `period` that is taken"),
        );
        source.report_with(given.span(), message, help);
        return None;
    }
    multiple(source, record, given, warnings)
}

/// The given period, where the inputs can have come back after it: refused where they have hardly left by then, warned of where it is
/// no whole multiple of the period that is found in them.
fn multiple(
    source: &Source,
    record: &Record,
    given: &Spanned<f64>,
    warnings: &mut Vec<String>,
) -> Option<f64> {
    let (period, name) = (*given.get_ref(), &record.name);
    let Some(known) = found(&record.inputs, record.start) else {
        if has_left(&record.inputs, record.start, period) {
            return Some(period);
        }
        let message = format!(
            "a period of {period} is none of record `{name}`: its inputs have hardly changed by then"
        );
        source.report_with(given.span(), message, "give the time after which inputs and data repeat");
        return None;
    };
    let times = (period / known).round();
    if times < 1.0 {
        let message = format!(
            "a period of {period} is far below that of record `{name}`, whose inputs repeat every {known:.6}"
        );
        source.report_with(
            given.span(),
            message,
            "without `period` that is taken; a whole multiple of it is right too",
        );
        return None;
    }
    let (nearest, resolved) = (times * known, RESOLVED * times * spacing(&record.inputs));
    if (period - nearest).abs() > resolved {
        warnings.push(format!(
            "`period` = {period} of record `{name}` is no whole multiple of {known:.6}, after which its inputs repeat ({nearest:.6} is the \
             nearest, to {resolved:.1e}): runs begin in a state that belongs to other inputs, and estimates follow it. Leave out `period`, \
             and {known:.6} is taken."
        ));
    }
    Some(period)
}

/// What does not repeat after a period, in words.
fn differing(model: &CheckedModel, record: &Record, period: f64) -> Option<String> {
    let told = |what: &str, name: &str, share: f64| {
        format!("{what} `{name}` differs from itself a period later by {:.0} % of its range", 100.0 * share)
    };
    let inputs = model.spec.inputs.iter().zip(&record.inputs).find_map(|(input, signal)| {
        let share = input_mismatch(signal, record.start, period).filter(|share| *share > NOT_PERIODIC)?;
        Some(told("input", &input.name, share))
    });
    inputs.or_else(|| {
        record.channels.iter().find_map(|channel| {
            Some(told("output", &channel.output, channel_mismatch(record, channel, period)?))
        })
    })
}
