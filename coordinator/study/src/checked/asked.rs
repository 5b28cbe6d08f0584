//! What a study asks of `explain`, `spectrum` and, beyond its estimates, of `run`.
//!
//! Next file to read: [`super`].

use starlings_models::spectrum::Decay;

/// Which effects `explain` may try.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Library {
    /// Those of the study and the built-in ones.
    #[default]
    All,
    /// Those of the study.
    Study,
    /// The built-in ones.
    BuiltIn,
}

/// Name by which `without` leaves out all terms that `explain` makes from the data, of which none is known before.
pub const PROPOSALS: &str = "proposals";

/// Settings of `explain`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ExplainChoice {
    /// Outputs that are never fitted.
    pub hold_out_channels: Vec<String>,
    /// Model runs at most.
    pub budget: Option<u64>,
    /// Where candidates come from.
    pub library: Library,
    /// Effects that are not to be tried.
    pub without: Vec<String>,
    /// Effects to try; empty for all.
    pub only: Vec<String>,
    /// Effects at most in one explanation; `None` for the command's own limit.
    pub max_effects: Option<usize>,
}

/// Settings of `spectrum`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SpectrumChoice {
    /// Kinds of observers; empty for all that the model can host.
    pub observers: Vec<String>,
    /// Gains in 1/time; empty for a range around the poles.
    pub gains: Vec<f64>,
    /// The decay that is wanted.
    pub decay: Option<Decay>,
}

/// What `run` predicts after the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictChoice {
    /// Outputs and scalar states, a field component by component; empty for nothing.
    pub outputs: Vec<String>,
    /// Draws of the posterior.
    pub members: usize,
    /// Spacing of times beside those of the records; none without it.
    pub step: Option<f64>,
}

impl Default for PredictChoice {
    fn default() -> Self {
        Self { outputs: Vec::new(), members: 200, step: None }
    }
}
