//! Luenberger observers: after a prediction is recorded, they pull the state towards the same time's observation.
//!
//! An observer never sees a datum before its prediction is recorded; [`crate::simulator`] holds that order. Those of a wall
//! stand on the model's [`crate::blocks`], the others on the states that outputs measure. Next file to read: [`nudging`],
//! then [`dvf`].

mod dvf;
mod dvf_am;
mod extension;
mod image_force;
mod measured;
mod none;
mod nudging;
mod sdf;
mod sdf_displacement;
mod sections;
mod slopes;
mod together;
mod wall;
mod windkessel;

use nalgebra::DMatrix;

use crate::SetupError;
use crate::setup::ObserverDef;
use crate::{Model, NativeModels, Spec, nearest};
use together::Together;

pub use measured::outputs_of;
pub use together::shared_state;

/// What an observer corrects with: one observation time.
#[derive(Clone, Copy)]
pub struct Correction<'a> {
    /// Observation time.
    pub t: f64,
    /// Per row of `observed` the time since its own last value, or since the start of the record; positive.
    pub spans: &'a [f64],
    /// Observed values, one per row of the predicted outputs; NaN where nothing was measured or it is held out.
    pub observed: &'a [f64],
    /// Predicted values, as recorded before this correction.
    pub predicted: &'a [f64],
    /// The model, effects included.
    pub model: &'a dyn Model,
    /// The model's parameters in this run.
    pub theta: &'a [f64],
}

/// Corrects a state by what was observed.
pub trait Observer: Send + Sync {
    /// Corrects the state `x` in place.
    fn correct(&self, at: Correction<'_>, x: &mut [f64]);

    /// Γ, n_state × n_state: with correct parameters and data without noise, the state error e obeys de/dt = (A − Γ) e
    /// under this observer at its gain in continuous time, A being the model's own linearisation; zero where nothing is
    /// observed. [`Correction`]s are its steps.
    fn feedback(&self, model: &dyn Model, theta: &[f64]) -> DMatrix<f64>;

    /// The rows of the predicted outputs that it corrects by.
    fn reads(&self) -> Vec<usize>;

    /// The largest stable gain with observations every `dt`; `None` for a correction that any gain leaves stable. `theta` are
    /// the parameters of `model`.
    fn stable_up_to(&self, _model: &dyn Model, _theta: &[f64], _dt: f64) -> Option<f64> {
        None
    }

    /// The first output component that shows nothing of the state component which it corrects: neither where runs start nor beside it,
    /// without inputs or with them. `None` where each shows something.
    fn blind(&self, _model: &dyn Model, _theta: &[f64]) -> Option<(usize, usize)> {
        None
    }

    /// What its poles stand for where that is not plain, to follow "poles"; `None` where [`Self::feedback`] says all.
    fn note(&self) -> Option<&'static str> {
        None
    }
}

/// What an observer is built against.
#[derive(Clone, Copy)]
pub struct Wiring<'a> {
    /// The model's specification, effects included.
    pub spec: &'a Spec,
    /// Names of the observed outputs, in the order of the rows; a field stands for all its components, `field[i]` for one.
    pub outputs: &'a [String],
    /// The model, effects included.
    pub model: &'a dyn Model,
    /// The model's parameters: constants and defaults, zero for what is estimated.
    pub theta: &'a [f64],
    /// The models among which an observer that this one cannot host names those that can.
    pub native: NativeModels,
}

/// Makes an observer from its definition.
pub(crate) type Build = fn(&ObserverDef, Wiring<'_>) -> Result<Box<dyn Observer>, SetupError>;

/// One observer of the list.
pub struct Kind {
    /// The `kind` by which a study names it.
    pub kind: &'static str,
    /// One plain sentence.
    pub says: &'static str,
    /// Makes it.
    pub(crate) build: Build,
}

/// Every observer.
pub fn kinds() -> Vec<Kind> {
    vec![
        none::KIND,
        nudging::KIND,
        sdf::KIND,
        dvf::KIND,
        dvf_am::KIND,
        sdf_displacement::KIND,
        image_force::KIND,
        windkessel::KIND,
    ]
}

/// Makes the observer that the definition names, with those beside it; an empty kind is `none`.
///
/// # Errors
/// When a kind is unknown, a gain is not a finite number ≥ 0, or an observer finds nothing to correct.
pub fn build(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Box<dyn Observer>, SetupError> {
    if def.beside.is_empty() { one(def, wiring) } else { Ok(Box::new(Together::new(def, wiring)?)) }
}

fn one(def: &ObserverDef, wiring: Wiring<'_>) -> Result<Box<dyn Observer>, SetupError> {
    let wanted = if def.kind.is_empty() { none::KIND.kind } else { def.kind.as_str() };
    let kinds = kinds();
    let Some(kind) = kinds.iter().find(|k| k.kind == wanted) else {
        return Err(SetupError::Unknown {
            what: "observer",
            name: def.kind.clone(),
            nearest: nearest(wanted, kinds.iter().map(|k| k.kind)),
        });
    };
    if !def.gain.is_finite() || def.gain < 0.0 {
        return Err(SetupError::Invalid(format!(
            "the observer's gain is {}: give a finite number, zero or above",
            def.gain
        )));
    }
    (kind.build)(def, wiring)
}
