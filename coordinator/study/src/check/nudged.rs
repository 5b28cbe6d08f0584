//! Whether the gain of a nudging observer is stable where the study says which output corrects which state.
//!
//! Judged at the prior medians: what an output shows of a state may depend on what is estimated. Next file to read:
//! [`super::observer`], for the other observers.

use starlings_models::catalogue::NATIVE;
use starlings_models::observer::{self, Wiring};
use starlings_models::spectrum::start;
use starlings_models::{BuildSetup, ObserverDef, SOLVER, SetupError};

use super::observer::{fitted, report, spacing};
use crate::file::ObserverSection;
use crate::problem::Source;
use crate::{Study, posterior};

/// The kind that is looked at here.
pub(super) const KIND: &str = "nudging";

/// Reports gains that are unstable.
pub(super) fn check(source: &Source, section: &ObserverSection, study: &Study) {
    if study.setup.model.kind == SOLVER {
        return;
    }
    for (section, def) in section.all().zip(study.setup.observer.all()) {
        if def.kind == KIND && !def.corrects.is_empty() {
            // What cannot be built was reported before.
            if let Ok(Some((dt, record, most))) = limit(study, def)
                && *section.gain.get_ref() > most
            {
                report(source, section, (dt, &record), most, &study.time_unit);
            }
        }
    }
}

/// The largest spacing of what corrects, the record that has it, and the largest stable gain; `None` where every gain is stable.
fn limit(study: &Study, def: &ObserverDef) -> Result<Option<(f64, String, f64)>, SetupError> {
    let medians = study.theta_for(0, posterior::prior(study).mean.as_slice());
    let (model, spec) = (study.setup.model()?, study.setup.spec()?);
    let (theta, _) = start(&study.setup, &*model, &medians)?;
    let fitted = fitted(&study.setup, &study.records);
    let of = |outputs: &[String]| {
        let wiring = Wiring { spec: &spec, outputs, model: &*model, theta: &theta, native: NATIVE };
        observer::build(&def.alone(), wiring)
    };
    // As it works in the fit, where held-out channels are never seen; records have rows of all outputs.
    let (observer, rows) = (of(&fitted)?, of(&study.setup.outputs)?.reads());
    let trained = study.records.iter().filter(|record| record.is_trained());
    let spacings = trained.filter_map(|record| Some((spacing(record, &rows)?, record.name.clone())));
    let Some((dt, record)) = spacings.max_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(None) };
    Ok(observer.stable_up_to(&*model, &theta, dt).map(|most| (dt, record, most)))
}
