//! The study file as it is written: every section and key, with its place, before any check of meaning.
//!
//! Types, missing and unknown keys are checked here; whether names exist and numbers make sense is checked in [`super::check`].
//! Next file to read: [`crate::file::read`], which fills these.

mod brackets;
mod channels;
pub(super) mod diagnose;
pub(super) mod infer;
pub(super) mod layout;
pub(super) mod locate;
pub(crate) mod memory;
mod model;
pub(super) mod predict;
mod quantity;
pub(super) mod read;
mod roles;
mod settings;
pub(super) mod solver;
pub(super) mod spectrum;
pub(super) mod table;

use std::ops::Range;

pub(super) use channels::{ChannelSection, Outliers, SurfaceSection};
use starlings_models::Role;
use toml::Spanned;

/// Name and value, in the order of the file.
pub(super) type Named<T> = Vec<(Spanned<String>, Spanned<T>)>;

/// The whole file.
#[derive(Debug)]
pub(super) struct StudyFile {
    pub(super) study: StudySection,
    pub(super) model: ModelSection,
    pub(super) parameters: Vec<ParameterSection>,
    pub(super) observer: ObserverSection,
    pub(super) records: Vec<RecordSection>,
    pub(super) effects: Vec<EffectSection>,
    pub(super) explain: ExplainSection,
    pub(super) spectrum: spectrum::SpectrumSection,
    pub(super) predict: predict::PredictSection,
    /// Present where the file has the section.
    pub(super) infer: Option<infer::InferSection>,
    /// Present where the file has the section.
    pub(super) diagnose: Option<diagnose::DiagnoseSection>,
    /// Whether there has to be a parameter to estimate.
    pub(super) needs_parameter: bool,
    pub(super) estimator: EstimatorSection,
    pub(super) fleet: FleetSection,
}

/// `[study]`.
#[derive(Debug)]
pub(super) struct StudySection {
    pub(super) name: Spanned<String>,
    pub(super) says: String,
    pub(super) seed: u64,
    pub(super) time_unit: String,
}

/// `[model]`.
#[derive(Debug)]
pub(super) struct ModelSection {
    pub(super) kind: Spanned<String>,
    pub(super) constants: Named<f64>,
    /// File of initial values.
    pub(super) initial: Option<Spanned<String>>,
    /// How the model is put together, with the places of its parts.
    pub(super) layout: Option<layout::Layout>,
    /// Present when `kind` is `equations`.
    pub(super) equations: Option<EquationsSection>,
    /// Where runs begin: `initial` or `periodic`.
    pub(super) start: Option<Spanned<String>>,
    /// Length of a period, of records that do not say.
    pub(super) period: Option<Spanned<f64>>,
    /// Steps that one run may take.
    pub(super) max_steps: Option<Spanned<u64>>,
    /// Seconds; a solver's stand in its own section.
    pub(super) timeout: Option<Spanned<f64>>,
    /// Present when `kind` is `solver`.
    pub(super) solver: Option<solver::ProgramSection>,
}

/// The keys of `[model]` that write a model.
#[derive(Debug)]
pub(super) struct EquationsSection {
    pub(super) states: Vec<StateSection>,
    pub(super) outputs: Vec<QuantitySection>,
    pub(super) inputs: Vec<QuantitySection>,
    pub(super) replaceable: Vec<Spanned<String>>,
    /// Meanings of parameters.
    pub(super) roles: Vec<(Spanned<String>, Role)>,
    pub(super) solver: SolverSection,
}

/// `solver = { ... }` of a model.
#[derive(Debug, Default)]
pub(super) struct SolverSection {
    pub(super) span: Range<usize>,
    pub(super) method: Option<Spanned<String>>,
    pub(super) rtol: Option<Spanned<f64>>,
    pub(super) atol: Option<Spanned<f64>>,
    pub(super) step: Option<Spanned<f64>>,
}

/// An output or an input of a model.
#[derive(Debug)]
pub(super) struct QuantitySection {
    pub(super) name: Spanned<String>,
    pub(super) unit: String,
    pub(super) role: Role,
    /// The expression of an output; empty for an input.
    pub(super) value: Spanned<String>,
}

/// `[[model.states]]`, or a state of an effect.
#[derive(Debug)]
pub(super) struct StateSection {
    pub(super) name: Spanned<String>,
    pub(super) unit: String,
    /// As it is written or told by the unit and the rates.
    pub(super) role: Option<Role>,
    /// A number or an expression, as text.
    pub(super) initial: Spanned<String>,
    /// Terms of the rate by name; a single text has the empty name.
    pub(super) rate: Named<String>,
    /// Amplitudes of white noise by source; a single text has the empty name.
    pub(super) noise: Named<String>,
}

/// `[[parameters]]`.
#[derive(Debug)]
pub(super) struct ParameterSection {
    pub(super) name: Spanned<String>,
    pub(super) unit: Option<Spanned<String>>,
    pub(super) prior: PriorSection,
    pub(super) process: ProcessSection,
    pub(super) per_record: Option<bool>,
}

/// `prior = { ... }`.
#[derive(Debug, Default)]
pub(super) struct PriorSection {
    pub(super) span: Range<usize>,
    pub(super) transform: Option<Spanned<String>>,
    pub(super) median: Option<Spanned<f64>>,
    pub(super) mean: Option<Spanned<f64>>,
    pub(super) median_from: Option<Spanned<String>>,
    pub(super) factor: Option<Spanned<f64>>,
    pub(super) sd: Option<Spanned<f64>>,
    pub(super) lo: Option<Spanned<f64>>,
    pub(super) hi: Option<Spanned<f64>>,
}

impl PriorSection {
    /// Its median, which of a Gaussian may be called its mean.
    pub(super) fn middle(&self) -> Option<&Spanned<f64>> {
        self.median.as_ref().or(self.mean.as_ref())
    }
}

/// `process = { ... }`.
#[derive(Debug, Default)]
pub(super) struct ProcessSection {
    pub(super) forgetting: Option<Spanned<f64>>,
    pub(super) walk: Option<Spanned<f64>>,
}

/// `[observer]`, or the first of a list `[[observer]]`.
#[derive(Clone, Debug)]
pub(super) struct ObserverSection {
    /// The others of the list.
    pub(super) beside: Vec<ObserverSection>,
    pub(super) kind: Spanned<String>,
    pub(super) gain: Spanned<f64>,
    /// Output → state.
    pub(super) corrects: Named<String>,
}

impl ObserverSection {
    /// This observer and the others of its list.
    pub(super) fn all(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.beside)
    }
}

/// `[[records]]`.
#[derive(Debug)]
pub(super) struct RecordSection {
    pub(super) span: Range<usize>,
    pub(super) name: Spanned<String>,
    pub(super) file: Spanned<String>,
    pub(super) time: Spanned<String>,
    /// Model input → column, or `file:column`.
    pub(super) inputs: Named<String>,
    pub(super) channels: Vec<ChannelSection>,
    /// Where the run begins, if before the first measured row.
    pub(super) start: Option<Spanned<f64>>,
    /// Length of a period.
    pub(super) period: Option<Spanned<f64>>,
    pub(super) train: Option<Spanned<[f64; 2]>>,
    pub(super) held_out: bool,
    /// Rows of a held-out record from which its start is found.
    pub(super) start_rows: Option<Spanned<u64>>,
    pub(super) every: Spanned<u64>,
}

/// `[[effects]]`.
#[derive(Debug)]
pub(super) struct EffectSection {
    pub(super) name: Spanned<String>,
    pub(super) says: String,
    pub(super) source: String,
    pub(super) built_in: Option<Spanned<String>>,
    /// To what, and the term.
    pub(super) adds: Named<String>,
    pub(super) parameters: Vec<EffectParameterSection>,
    pub(super) states: Vec<StateSection>,
    pub(super) confounders: Vec<String>,
}

/// A parameter of an effect.
#[derive(Debug)]
pub(super) struct EffectParameterSection {
    pub(super) name: Spanned<String>,
    pub(super) unit: String,
    pub(super) range: Option<[f64; 2]>,
    pub(super) grid: Vec<f64>,
    /// Whether it is a width over which the term rounds a corner.
    pub(super) rounds: bool,
}

/// `[explain]`.
#[derive(Debug, Default)]
pub(super) struct ExplainSection {
    pub(super) hold_out_channels: Vec<Spanned<String>>,
    pub(super) budget: Option<Spanned<u64>>,
    pub(super) library: Option<Spanned<String>>,
    pub(super) without: Vec<Spanned<String>>,
    pub(super) only: Vec<Spanned<String>>,
    pub(super) max_effects: Option<Spanned<u64>>,
}

/// `[estimator]`.
#[derive(Debug, Default)]
pub(super) struct EstimatorSection {
    pub(super) kind: Option<Spanned<String>>,
    pub(super) points: Option<Spanned<String>>,
    pub(super) kappa: Option<Spanned<f64>>,
    pub(super) root: Option<Spanned<String>>,
    pub(super) passes: Option<Spanned<u64>>,
    pub(super) anneal: Option<Spanned<f64>>,
    pub(super) spread: Option<Spanned<f64>>,
    pub(super) resample: Option<Spanned<String>>,
    pub(super) max_iterations: Option<Spanned<u64>>,
    pub(super) tolerance: Option<Spanned<f64>>,
}

/// `[fleet]`.
#[derive(Debug, Default)]
pub(super) struct FleetSection {
    pub(super) workers: Option<Spanned<u64>>,
    pub(super) slots: Option<Spanned<u64>>,
    pub(super) patience: Option<Spanned<f64>>,
    pub(super) max_attempts: Option<Spanned<u64>>,
    pub(super) timeout_factor: Option<Spanned<f64>>,
}
