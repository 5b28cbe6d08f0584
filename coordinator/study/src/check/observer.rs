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
        if let Some(built) = built(source, (file, section), (setup, def), records) {
            check_gain(source, (file, section), records, &built);
        }
    }
}

/// An observer with the model that it was built against, and the model's parameters.
struct Built {
    observer: Box<dyn Observer>,
    model: Box<dyn Model>,
    theta: Vec<f64>,
}

/// The observer as it works in the fit, where held-out channels are never seen; `None` when a problem was reported.
fn built(
    source: &Source,
    (file, section): (&StudyFile, &ObserverSection),
    (setup, def): (&Setup, &ObserverDef),
    records: &[Record],
) -> Option<Built> {
    let seen = |output: &String| {
        let channels = records.iter().filter(|r| r.is_trained()).flat_map(|r| &r.channels);
        channels.into_iter().any(|c| c.output == *output && !c.held_out)
    };
    let fitted: Vec<String> = setup.outputs.iter().filter(|o| seen(o)).cloned().collect();
    let build = |outputs: &[String]| -> Result<Built, SetupError> {
        let (model, spec) = (setup.model()?, setup.spec()?);
        let theta = constants(setup, &spec);
        let wiring = Wiring { spec: &spec, outputs, model: &*model, theta: &theta, native: NATIVE };
        let observer = observer::build(&def.alone(), wiring)?;
        Ok(Built { observer, model, theta })
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
    let spacings = records.iter().filter(|r| r.is_trained()).filter_map(|r| Some((r, spacing(r)?)));
    let Some((record, dt)) = spacings.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let Built { observer, model, theta } = built;
    let Some(largest) = observer.stable_up_to(&**model, theta, dt).filter(|most| gain > *most) else {
        return;
    };
    let unit = &file.study.time_unit;
    source.report_with(
        section.gain.span(),
        format!(
            "a gain of {gain} is unstable: the observer `{}` corrects in steps, and record `{}` is observed {dt:.4} {unit} apart",
            section.kind.get_ref(),
            record.name
        ),
        format!("the largest stable gain is {largest:.4} 1/{unit}: lower the gain, or use data observed more often"),
    );
}

/// Largest time between the observations that a record fits: the gain must be stable over every one.
fn spacing(record: &Record) -> Option<f64> {
    let rows = training_rows(record);
    rows.windows(2).map(|w| record.times[w[1]] - record.times[w[0]]).max_by(f64::total_cmp)
}
