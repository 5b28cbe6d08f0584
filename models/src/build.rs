//! From a setup to what runs its jobs: the model by its kind, its effects, its observer.
//!
//! Next file to read: [`crate::catalogue`].

use std::sync::Arc;

use crate::effect::{Extended, library};
use crate::memory::with_memories;
use crate::{EffectDef, Forward, Model, SOLVER, Setup, SetupError, Simulator, Spec, catalogue, external};

/// Makes what runs the jobs of a setup.
pub type Factory = Arc<dyn Fn(&Setup) -> Result<Box<dyn Forward>, SetupError> + Send + Sync>;

impl Setup {
    /// Builds what runs jobs, and checks that everything fits together.
    ///
    /// # Errors
    /// When a name is unknown (with the nearest valid one), given twice or without value, or an expression is wrong.
    pub fn build(&self) -> Result<Box<dyn Forward>, SetupError> {
        if self.model.kind == SOLVER {
            let message = "the model runs in a program of its own, which only a worker starts";
            return Err(SetupError::Invalid(message.to_owned()));
        }
        Ok(Box::new(Simulator::new(self)?))
    }

    /// What the model says of itself, effects and memories included; parameters, outputs and observer are not looked at.
    ///
    /// # Errors
    /// When the model or an effect does not build.
    pub fn spec(&self) -> Result<Spec, SetupError> {
        if let Some(description) = self.model.description() {
            return external::spec(self, description);
        }
        let model = self.model()?;
        Ok(with_memories(model.spec(), model.memories()))
    }

    /// The model with its effects. Of a solver only the specification is known: its rates and outputs are no numbers.
    ///
    /// # Errors
    /// When the model or an effect does not build.
    pub fn model(&self) -> Result<Box<dyn Model>, SetupError> {
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

    /// The effects with the built-in ones written out for a model of this specification; their unit labels, which no run
    /// reads, are those of a time in seconds.
    ///
    /// # Errors
    /// When the model has no such built-in effect.
    pub fn written_out_effects(&self, spec: &Spec) -> Result<Vec<EffectDef>, SetupError> {
        self.effects.iter().map(|def| library::write_out(def, spec, "s")).collect()
    }
}
