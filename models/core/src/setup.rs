//! What is sent to a worker once: the model, its constants, its observer and its effects, by name.
//!
//! These types are plain data (serde); the crate above builds a model of them and checks that they fit
//! together. Next file to read: [`crate::simulator`].

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::{EffectDef, library};
use crate::equations::EquationsDef;
use crate::solver::{Description, SolverDef};
use crate::sums_def::SumsDef;
use crate::{SetupError, Spec};

/// The model by kind, with the values that are not estimated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelDef {
    /// A kind in the list of a family of built-in models, `equations` or `solver`.
    pub kind: String,
    /// Fixed parameter values by name.
    pub constants: BTreeMap<String, f64>,
    /// The equations, when `kind` is `equations`.
    pub equations: Option<EquationsDef>,
    /// How the model is put together, where its kind leaves that to the study; see [`crate::layout`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<serde_json::Value>,
    /// The solver, when `kind` is [`crate::SOLVER`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<Box<SolverDef>>,
}

impl ModelDef {
    /// What the solver says of itself, where the model is one.
    pub fn description(&self) -> Option<&Description> {
        self.solver.as_ref()?.described.as_ref()
    }
}

/// The observer by kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObserverDef {
    /// A kind in the list of [`crate::observer`], or `none`.
    pub kind: String,
    /// Gain in 1/time unit.
    pub gain: f64,
    /// Output → state that it corrects; of an output that is named here the model's own pair does not count.
    pub corrects: BTreeMap<String, String>,
    /// Whether it observes the outputs in `corrects` alone, since another of its kind stands beside it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub named_only: bool,
    /// Observers that correct other states in the same run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<ObserverDef>,
}

impl ObserverDef {
    /// This observer and those beside it.
    pub fn all(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.beside)
    }

    /// Its kind, joined with those beside it: `sdf + windkessel`, or `nudging of y1 + nudging of y2`.
    pub fn name(&self) -> String {
        self.names().join(" + ")
    }

    /// The names of all: their kinds; where several are of one kind with the outputs in `corrects`, or a number without any.
    pub fn names(&self) -> Vec<String> {
        let is_twice = |def: &Self| self.all().filter(|other| other.kind == def.kind).count() > 1;
        let name = |(k, def): (usize, &Self)| match def.corrects.keys().cloned().collect::<Vec<_>>() {
            _ if !is_twice(def) => def.kind.clone(),
            outputs if outputs.is_empty() => format!("{} number {}", def.kind, k + 1),
            outputs => format!("{} of {}", def.kind, outputs.join(", ")),
        };
        self.all().enumerate().map(name).collect()
    }

    /// Whether none of them corrects anything.
    pub fn is_off(&self) -> bool {
        self.all().all(|def| matches!(def.kind.as_str(), "" | "none") || def.gain <= 0.0)
    }

    /// The same at another gain, those beside it in proportion.
    #[must_use]
    pub fn at(&self, gain: f64) -> Self {
        let share = if self.gain > 0.0 { gain / self.gain } else { 0.0 };
        let beside = self.beside.iter().map(|def| Self { gain: share * def.gain, ..def.clone() });
        Self { gain, beside: beside.collect(), ..self.clone() }
    }

    /// Without those beside it.
    #[must_use]
    pub fn alone(&self) -> Self {
        Self { beside: Vec::new(), ..self.clone() }
    }
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
    /// Seed of the model's noise; without one its noise is left out, and what runs is the drift alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<u64>,
    /// Seconds of computing that one run may take; [`crate::limits::TIMEOUT`] where nothing is said. A solver has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeout: Option<f64>,
    /// Period of each record, by its number, where runs that are given no state begin in the periodic one; empty where they begin in
    /// the initial state.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub periods: Vec<f64>,
    /// Whether every run predicts, after the outputs at a time, their derivatives by each of the parameters in turn: as many rows for each.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub slopes: bool,
    /// What jobs of a dynamical inference sum over their rows, instead of running the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sums: Option<Box<SumsDef>>,
}

impl Setup {
    /// The effects with the built-in ones written out for a model of this specification; their unit labels, which no run
    /// reads, are those of a time in seconds.
    ///
    /// # Errors
    /// When the model has no such built-in effect.
    pub fn written_out_effects(&self, spec: &Spec) -> Result<Vec<EffectDef>, SetupError> {
        self.effects.iter().map(|def| library::write_out(def, spec, "s")).collect()
    }
}
