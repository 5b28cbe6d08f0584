//! What is sent to a worker once: the model, its constants, its observer and its effects, by name.
//!
//! These types are plain data (serde); building checks that they fit together. Next file to read: [`crate::catalogue`].

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::effect::{EffectDef, Extended, library};
use crate::equations::EquationsDef;
use crate::external;
use crate::memory::with_memories;
use crate::solver::{Description, SOLVER, SolverDef};
use crate::{Forward, Model, Simulator, Spec, catalogue};

/// The model by kind, with the values that are not estimated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelDef {
    /// A kind in the [`crate::catalogue`], or `equations`.
    pub kind: String,
    /// Fixed parameter values by name.
    pub constants: BTreeMap<String, f64>,
    /// The equations, when `kind` is `equations`.
    pub equations: Option<EquationsDef>,
    /// How the model is put together, where its kind leaves that to the study; see [`crate::layout`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<serde_json::Value>,
    /// The solver, when `kind` is [`SOLVER`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<Box<SolverDef>>,
}

impl ModelDef {
    /// What the solver says of itself, where the model is one.
    pub fn description(&self) -> Option<&Description> {
        self.solver.as_ref()?.described.as_ref()
    }
}

/// Makes what runs the jobs of a setup.
pub type Factory = Arc<dyn Fn(&Setup) -> Result<Box<dyn Forward>, SetupError> + Send + Sync>;

/// The observer by kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObserverDef {
    /// A kind in the list of [`crate::observer`], or `none`.
    pub kind: String,
    /// Gain in 1/time unit.
    pub gain: f64,
    /// Output → state that it corrects, where the model does not say so itself.
    pub corrects: BTreeMap<String, String>,
}

/// Everything that stays the same over the jobs of one fit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// The model.
    pub model: ModelDef,
    /// Names of the values in [`crate::Job::theta`]: model parameters, effect parameters, or `initial:<state>`.
    pub parameters: Vec<String>,
    /// Names of the predicted outputs, the rows of [`crate::Prediction::outputs`]. A name that no output has may be a scalar
    /// state's: it is recorded as it is at each time, before any correction, and no observer takes it for measured.
    pub outputs: Vec<String>,
    /// The observer.
    pub observer: ObserverDef,
    /// Effects added to the model.
    pub effects: Vec<EffectDef>,
    /// Steps that one run may take; [`crate::limits::MAX_STEPS`] where nothing is said. A solver counts its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<u64>,
    /// Seconds of computing that one run may take; [`crate::limits::TIMEOUT`] where nothing is said. A solver has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeout: Option<f64>,
}

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

/// Why a setup does not make a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A name that the model, the catalogue or the effect list does not have.
    #[error("no {what} named `{name}`{}", nearest.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    Unknown {
        /// What was looked for, such as `model`, `parameter` or `rate term`.
        what: &'static str,
        /// The name given.
        name: String,
        /// The nearest valid name, if one is close.
        nearest: Option<String>,
    },
    /// A model parameter that neither the constants nor the parameters give.
    #[error(
        "parameter `{name}` of model `{model}` has no value: add it to the model's constants or to the parameters"
    )]
    Missing {
        /// The model's kind.
        model: String,
        /// The parameter.
        name: String,
    },
    /// A name given twice.
    #[error("`{0}` is given twice")]
    Twice(String),
    /// An expression that does not parse or uses what it may not.
    #[error("in `{expression}` at column {column}: {message}")]
    Expression {
        /// Where the expression stands, such as `rate of v` or `effect overflow`.
        place: String,
        /// The expression's text.
        expression: String,
        /// Character position of the fault, from 1.
        column: usize,
        /// What is wrong and what was expected.
        message: String,
    },
    /// A fault in the layout of a model.
    #[error("in the model's layout{}: {message}", if path.is_empty() || path == "." { String::new() } else { format!(" at `{path}`") })]
    Layout {
        /// The place, such as `regions[2].to`; empty for the layout as a whole.
        path: String,
        /// What is wrong and what was expected.
        message: String,
    },
    /// Anything else that does not fit.
    #[error("{0}")]
    Invalid(String),
}
