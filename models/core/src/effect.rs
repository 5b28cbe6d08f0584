//! An effect: a named, removable piece of physics that is added to a running model.
//!
//! At amplitude zero it is absent. It may enter several equations, outputs, inputs and parameters of the model at once, carry
//! several parameters and bring states of its own. Nothing here decides which effect a recording needs. Next file to read: [`def`] for what a study
//! says, [`scope`] for what its terms may name, [`terms`] for how it is evaluated, [`extended`] for the model with its
//! effects, [`mod@library`] for the built-in list.

mod def;
mod extended;
mod extended_spec;
pub mod library;
pub mod scale;
mod scope;
mod target;
mod terms;

use crate::Drive;

pub use def::{Addition, EffectDef, EffectParameter, EffectState};
pub use extended::Extended;
pub use library::library;
pub use scale::Scale;
pub use scope::names;
pub use target::Target;
pub(crate) use terms::TermEffect;

/// One time of an extended model. Slices follow the extended specification; `y` holds the inner model's outputs before any
/// term is added to them, and is empty unless [`Touches::reads_outputs`].
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    /// Time.
    pub t: f64,
    /// The extended state.
    pub x: &'a [f64],
    /// The extended parameters.
    pub theta: &'a [f64],
    /// The recorded inputs, before any effect; with the additions of effects for a term that adds to an output.
    pub u: Drive<'a>,
    /// The inner model's outputs.
    pub y: &'a [f64],
}

/// Which parts of a model an effect enters; the wrapper keeps the inner model's exact step where it can.
#[allow(clippy::struct_excessive_bools, reason = "a set of independent facts")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Touches {
    /// It adds to a rate or brings states.
    pub rates: bool,
    /// It adds to an output.
    pub outputs: bool,
    /// It adds to an input.
    pub inputs: bool,
    /// It adds to a parameter of the model.
    pub parameters: bool,
    /// A term that adds to a parameter uses more than parameters and constants, so that the parameter changes during a run.
    pub parameters_vary: bool,
    /// One of its terms reads an output.
    pub reads_outputs: bool,
    /// A term that adds to an input reads a state.
    pub inputs_follow_states: bool,
}

impl Touches {
    /// What this effect or the other touches.
    #[must_use]
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            rates: self.rates || other.rates,
            outputs: self.outputs || other.outputs,
            inputs: self.inputs || other.inputs,
            parameters: self.parameters || other.parameters,
            parameters_vary: self.parameters_vary || other.parameters_vary,
            reads_outputs: self.reads_outputs || other.reads_outputs,
            inputs_follow_states: self.inputs_follow_states || other.inputs_follow_states,
        }
    }
}

/// Adds physics to a model. Every method adds to what stands in the slice; none overwrites it, except an effect's own states.
pub(crate) trait Effect: Send + Sync {
    /// Which parts of the model it enters.
    fn touches(&self) -> Touches;

    /// Writes the initial values of its own states into the extended state `x`.
    fn initial(&self, theta: &[f64], x: &mut [f64]);

    /// Adds to the inputs' values `value` and to their time derivatives `slope`; `rate` is the rate of the extended state,
    /// or empty where it does not matter.
    fn add_to_inputs(&self, at: Moment<'_>, rate: &[f64], value: &mut [f64], slope: &mut [f64]);

    /// Adds to the parameters of the model as it sees them at this time.
    fn add_to_parameters(&self, at: Moment<'_>, theta: &mut [f64]);

    /// Adds to the rates of the extended state.
    fn add_to_rates(&self, at: Moment<'_>, dx: &mut [f64]);

    /// Adds to the outputs.
    fn add_to_outputs(&self, at: Moment<'_>, y: &mut [f64]);

    /// Number of switching functions in what it adds to rates, inputs and parameters.
    fn n_switch(&self) -> usize;

    /// Writes its switching functions, as [`crate::Model::switches`].
    fn switches(&self, at: Moment<'_>, g: &mut [f64]);
}
