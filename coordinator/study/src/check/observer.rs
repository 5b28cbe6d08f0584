//! Whether the observer fits the recordings: what it needs is fitted, and its gain is stable at their spacing.
//!
//! Whether it fits the model is checked when the model is built: see [`super::model::check_build`]. Next file to read:
//! [`super::blame`].

use starlings_models::catalogue::NATIVE;
use starlings_models::observer::{self, Observer, Wiring};
use starlings_models::{BuildSetup, Model, ObserverDef, SOLVER, Setup, SetupError, Spec};

use super::blame::blame;
use crate::checked::Record;
use crate::file::{ObserverSection, StudyFile};
use crate::plan::training_rows;
use crate::problem::Source;

/// Reports an observer that lacks what it needs, or whose gain makes its correction unstable.
pub(crate) fn check(source: &Source, file: &StudyFile, setup: &Setup, records: &[Record]) {
    // What an observer inside a solver needs, and which gains are stable there, is not known here.
    if setup.model.kind == SOLVER {
        return;
    }
    for (section, def) in file.observer.all().zip(setup.observer.all()) {
        if matches!(def.kind.as_str(), "" | "none") {
            continue;
        }
        // What nudging sees may depend on what is estimated: [`super::nudged`] looks at the prior medians.
        if let Some(built) = built(source, (file, section), (setup, def), records)
            && def.kind != super::nudged::KIND
        {
            check_gain(source, (file, section), records, &built);
        }
    }
}

/// An observer with the model that it was built against, and the model's parameters.
struct Built {
    observer: Box<dyn Observer>,
    model: Box<dyn Model>,
    theta: Vec<f64>,
    /// Rows of all outputs of the study by which it corrects.
    rows: Vec<usize>,
}

/// The observer as it works in the fit, where held-out channels are never seen; `None` when a problem was reported.
fn built(
    source: &Source,
    (file, section): (&StudyFile, &ObserverSection),
    (setup, def): (&Setup, &ObserverDef),
    records: &[Record],
) -> Option<Built> {
    let fitted = fitted(setup, records);
    let build = |outputs: &[String]| -> Result<Built, SetupError> {
        let (model, spec) = (setup.model()?, setup.spec()?);
        let theta = constants(setup, &spec);
        let wiring = Wiring { spec: &spec, outputs, model: &*model, theta: &theta, native: NATIVE };
        let observer = observer::build(&def.alone(), wiring)?;
        let all = observer::build(&def.alone(), Wiring { outputs: &setup.outputs, ..wiring })?;
        let rows = all.reads();
        Ok(Built { observer, model, theta, rows })
    };
    match (build(&fitted), build(&setup.outputs)) {
        (Ok(built), _) => Some(built),
        (Err(error), Err(_)) => {
            blame(source, file, &error);
            None
        }
        (Err(error), Ok(_)) => {
            let message = format!(
                "without the channels that are held out, the observer has not what it needs: {error}"
            );
            source.report_with(
                section.kind.span(),
                message,
                "remove the channels that it needs from `hold_out_channels`, or choose another observer",
            );
            None
        }
    }
}

/// Outputs of the study that some record fits.
pub(super) fn fitted(setup: &Setup, records: &[Record]) -> Vec<String> {
    let seen = |output: &&String| {
        let mut channels = records.iter().filter(|r| r.is_trained()).flat_map(|r| &r.channels);
        channels.any(|c| c.output == **output && !c.held_out)
    };
    setup.outputs.iter().filter(seen).cloned().collect()
}

/// Constants and defaults in the order of the model's parameters, zero for what is estimated.
fn constants(setup: &Setup, spec: &Spec) -> Vec<f64> {
    let value = |q: &starlings_models::Quantity| {
        let constant = setup.model.constants.get(&q.name).copied();
        let estimated = setup.parameters.contains(&q.name);
        constant.or(q.default.filter(|_| !estimated)).unwrap_or(0.0)
    };
    spec.parameters.iter().map(value).collect()
}

/// A correction in steps is stable up to a gain that depends on the time between observations.
fn check_gain(
    source: &Source,
    (file, section): (&StudyFile, &ObserverSection),
    records: &[Record],
    built: &Built,
) {
    let gain = *section.gain.get_ref();
    let Built { observer, model, theta, rows } = built;
    let spacings = records.iter().filter(|r| r.is_trained()).filter_map(|r| Some((r, spacing(r, rows)?)));
    let Some((record, dt)) = spacings.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let Some(largest) = observer.stable_up_to(&**model, theta, dt).filter(|most| gain > *most) else {
        return;
    };
    report(source, section, (dt, &record.name), largest, &file.study.time_unit);
}

/// Reports a gain above the largest stable one where a record is observed so far apart.
pub(super) fn report(
    source: &Source,
    section: &ObserverSection,
    (dt, record): (f64, &str),
    largest: f64,
    unit: &str,
) {
    let (gain, kind) = (*section.gain.get_ref(), section.kind.get_ref());
    if largest <= 0.0 {
        source.report_with(
            section.gain.span(),
            format!("no gain is stable: what `corrects` says makes the observer `{kind}` drive an error away from the data"),
            "an output may only correct a state with which it rises: correct another state, or give the output the other sign",
        );
        return;
    }
    source.report_with(
        section.gain.span(),
        format!(
            "a gain of {gain} is unstable: the observer `{kind}` corrects in steps, and record `{record}` is observed {dt:.4} {unit} apart"
        ),
        format!("the largest stable gain is {largest:.4} 1/{unit}: lower the gain, or use data observed more often"),
    );
}

/// Largest time between two values of one channel that a record fits and the observer corrects by: the gain must be stable over it.
pub(super) fn spacing(record: &Record, read: &[usize]) -> Option<f64> {
    let rows = training_rows(record);
    let channels = record.channels.iter().filter(|c| !c.held_out && read.contains(&c.row));
    let largest = channels.filter_map(|channel| {
        let times: Vec<f64> = rows
            .iter()
            .filter(|row| channel.values[**row].is_finite())
            .map(|row| record.times[*row])
            .collect();
        times.windows(2).map(|w| w[1] - w[0]).max_by(f64::total_cmp)
    });
    largest.max_by(f64::total_cmp)
}
