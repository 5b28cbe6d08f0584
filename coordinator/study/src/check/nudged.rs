//! Whether the gain of a nudging observer is stable where the study says which output corrects which state.
//!
//! Judged at the prior medians: what an output shows of a state may depend on what is estimated. Next file to read:
//! [`super::observer`], for the other observers.

use starlings_models::catalogue::NATIVE;
use starlings_models::equations::Expression;
use starlings_models::observer::{self, Wiring};
use starlings_models::spectrum::start;
use starlings_models::{BuildSetup, ObserverDef, SOLVER, Setup, SetupError, Spec};

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
            let Ok(found) = Judged::new(study, def) else { continue };
            if let Some((output, state)) = found.blind {
                source.report_with(
                    section.kind.span(),
                    format!("the output `{output}` does not depend on the state `{state}`, which it is to correct: no gain brings it to the data"),
                    "let it correct a state on which it depends, or leave it out of `corrects`",
                );
            } else if let Some((dt, record, most)) = found.limit
                && *section.gain.get_ref() > most
            {
                report(source, section, (dt, &record), most, &study.time_unit);
            }
        }
    }
}

/// What is found of an observer.
struct Judged {
    /// An output that does not depend on the state that it corrects, and that state.
    blind: Option<(String, String)>,
    /// The largest spacing of what corrects, the record that has it, and the largest stable gain; `None` where every gain is stable.
    limit: Option<(f64, String, f64)>,
}

impl Judged {
    fn new(study: &Study, def: &ObserverDef) -> Result<Self, SetupError> {
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
        let widest = spacings.max_by(|a, b| a.0.total_cmp(&b.0));
        let named =
            |(output, state)| (Spec::component(&spec.outputs, output), Spec::component(&spec.states, state));
        let limit =
            widest.and_then(|(dt, record)| Some((dt, record, observer.stable_up_to(&*model, &theta, dt)?)));
        let blind = observer.blind(&*model, &theta).map(named);
        // What is flat where runs start, as `max(x - 2, 0)` of a small x, depends on it all the same.
        let blind = blind.filter(|(output, state)| !mentions(&study.setup, output, state));
        Ok(Self { blind, limit })
    }
}

/// Whether the equation of an output, or of one that it reads, names a state; of models without equations nothing is known.
fn mentions(setup: &Setup, output: &str, state: &str) -> bool {
    let Some(equations) = &setup.model.equations else { return false };
    let (mut left, mut seen) = (vec![output.to_owned()], Vec::new());
    while let Some(name) = left.pop() {
        if name == state {
            return true;
        }
        let value = equations.outputs.iter().find(|known| known.name == name);
        if let Some(expression) = value.and_then(|known| Expression::parse(&known.value).ok())
            && !seen.contains(&name)
        {
            left.extend(expression.names().into_iter().map(|(name, _)| name));
            seen.push(name);
        }
    }
    false
}
