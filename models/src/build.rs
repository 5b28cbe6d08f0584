//! From a setup to what runs its jobs: the model by its kind, its effects, its observer.
//!
//! A setup is plain data that knows no family of models, so that these are methods of a trait. Next file to read:
//! [`crate::catalogue`].

use std::sync::Arc;

use starlings_models_core::effect::Extended;
use starlings_models_core::periodic::beginning;
use starlings_models_core::{
    Forward, Model, SOLVER, Setup, SetupError, Simulator, Spec, external, with_memories,
};

use crate::catalogue;

/// Makes what runs the jobs of a setup.
pub type Factory = Arc<dyn Fn(&Setup) -> Result<Box<dyn Forward>, SetupError> + Send + Sync>;

/// What the catalogue makes of a setup.
pub trait BuildSetup {
    /// Builds what runs jobs, and checks that everything fits together.
    ///
    /// # Errors
    /// When a name is unknown (with the nearest valid one), given twice or without value, or an expression is wrong.
    fn build(&self) -> Result<Box<dyn Forward>, SetupError>;

    /// What the model says of itself, effects and memories included; parameters, outputs and observer are not looked at.
    ///
    /// # Errors
    /// When the model or an effect does not build.
    fn spec(&self) -> Result<Spec, SetupError>;

    /// The model with its effects. Of a solver only the specification is known: its rates and outputs are no numbers.
    ///
    /// # Errors
    /// When the model or an effect does not build.
    fn model(&self) -> Result<Box<dyn Model>, SetupError>;

    /// Whether the model's states have noise; no for a model that does not build.
    fn is_noisy(&self) -> bool {
        self.model().is_ok_and(|model| model.n_noise() > 0)
    }
}

impl BuildSetup for Setup {
    fn build(&self) -> Result<Box<dyn Forward>, SetupError> {
        if self.model.kind == SOLVER {
            let message = "the model runs in a program of its own, which only a worker starts";
            return Err(SetupError::Invalid(message.to_owned()));
        }
        beginning(Box::new(Simulator::new(self.model()?, self, catalogue::NATIVE)?), self)
    }

    fn spec(&self) -> Result<Spec, SetupError> {
        if let Some(description) = self.model.description() {
            return external::spec(self, description);
        }
        let model = self.model()?;
        Ok(with_memories(model.spec(), model.memories()))
    }

    fn model(&self) -> Result<Box<dyn Model>, SetupError> {
        let inner = catalogue::build(&self.model)?;
        if let Some(description) = self.model.description() {
            external::check_effects(self, description)?;
        }
        if self.effects.is_empty() {
            return Ok(inner);
        }
        let effects = self.written_out_effects(inner.spec())?;
        Ok(Box::new(Extended::new(inner, &effects, &self.model.constants)?))
    }
}
