//! A study with another model: effects added to it, replaceable terms left out, their parameters estimated with the others.
//!
//! The result is a [`Study`] again, so that everything that works on a study works on it; recordings and outputs stay as
//! they are. Parameters that only a term left out used are gone with it. Next file to read: [`super::expand`].

use starlings_estimators::{Drift, Transform};
use starlings_models::{BuildSetup, EffectDef, SetupError};

use super::checked::{Study, StudyParameter};
use super::expand::{self, INITIAL};
use super::field::quantity_of;

/// What is known of an effect's parameter before the data.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPrior {
    /// Map to the units in which the prior is Gaussian.
    pub transform: Transform,
    /// Prior mean in transformed units.
    pub mean: f64,
    /// Prior standard deviation in transformed units.
    pub sd: f64,
}

/// An effect to be added, with the priors of its parameters, in their order.
pub type WithPriors = (EffectDef, Vec<EffectPrior>);

impl Study {
    /// This study with effects added to its model and replaceable terms of its equations left out.
    ///
    /// # Errors
    /// When a term is not replaceable or an effect does not fit the model.
    pub fn with_model(&self, added: &[WithPriors], left_out: &[String]) -> Result<Self, SetupError> {
        let mut study = self.clone();
        if !left_out.is_empty() {
            let terms: Vec<&str> = left_out.iter().map(String::as_str).collect();
            let Some(equations) = &self.setup.model.equations else {
                let message =
                    format!("model `{}` has no terms that could be left out", self.setup.model.kind);
                return Err(SetupError::Invalid(message));
            };
            study.setup.model.equations = Some(equations.without(&terms)?);
        }
        for (effect, priors) in added {
            study.setup.effects.push(effect.clone());
            for (parameter, prior) in effect.parameters.iter().zip(priors) {
                study.setup.parameters.push(parameter.name.clone());
                study.parameters.push(StudyParameter {
                    name: parameter.name.clone(),
                    unit: parameter.unit.clone(),
                    transform: prior.transform,
                    per_record: false,
                    prior_mean: vec![prior.mean; self.records.len()],
                    prior_sd: prior.sd,
                    drift: Drift::None,
                });
            }
        }
        study.forget_unused()?;
        study.spec = study.setup.model()?.spec().clone();
        study.theta = expand::theta(&study.parameters, &study.records);
        study.delays |= added.iter().any(|(effect, _)| has_delay(effect));
        Ok(study)
    }

    /// Drops parameters and constants that the model no longer has.
    fn forget_unused(&mut self) -> Result<(), SetupError> {
        let spec = self.setup.model()?.spec().clone();
        let used = starlings_models::effect::names(&self.setup.effects)?;
        let known = |name: &String| {
            name.starts_with(INITIAL) || quantity_of(&spec.parameters, name).is_some() || used.contains(name)
        };
        self.setup.parameters.retain(known);
        self.parameters.retain(|p| known(&p.name));
        self.setup.model.constants.retain(|name, _| known(name));
        Ok(())
    }
}

/// Whether a term of an effect reads the past.
pub(super) fn has_delay(effect: &EffectDef) -> bool {
    let terms = effect.adds.iter().map(|a| &a.term);
    terms.chain(effect.states.iter().map(|s| &s.rate)).any(|text| reads_past(text))
}

/// Whether an expression reads the past.
pub(super) fn reads_past(expression: &str) -> bool {
    expression.replace(' ', "").contains("delay(")
}
