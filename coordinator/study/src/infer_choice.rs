//! What `infer` asks of which recordings: plain data, checked, that the inference uses without further checks.
//!
//! Recordings are described here and read elsewhere, block by block. Next file to read: [`crate::check`], which fills these.

use std::path::PathBuf;

use starlings_models::SumsDef;

/// Settings of `infer`.
#[derive(Clone, Debug, PartialEq)]
pub struct InferChoice {
    /// The functions. Its step is that of the study, or zero for that of the first record.
    pub sums: SumsDef,
    /// The form of the noise.
    pub diffusion: DiffusionChoice,
    /// Whether the Jacobian's term counts.
    pub prefactor: bool,
    /// What to do about errors of the measurement.
    pub measured: MeasuredChoice,
    /// Steps of a block; `None` for as many as suit the first recording's length.
    pub block: Option<usize>,
    /// Steps of a block at most: its rows travel in one message.
    pub most_steps: usize,
    /// Whether a recording goes on in a new piece where rows are missing.
    pub breaks: bool,
    /// Whether rows are interpolated to equal steps, those of the sums.
    pub resample: bool,
    /// Mean and standard deviation of every coefficient with a prior, by name.
    pub priors: Vec<(String, f64, f64)>,
    /// A model with fewer unknowns behind the coefficients.
    pub reduced: Option<ReducedChoice>,
    /// How terms that the drift lacks are looked for, among the candidates of the sums.
    pub missing: Option<MissingChoice>,
    /// How a recording is followed.
    pub follow: FollowChoice,
    /// The recordings.
    pub records: Vec<InferRecord>,
    /// Recordings that nothing is inferred from, on which missing terms are compared; none where none is looked for.
    pub held_out: Vec<InferRecord>,
}

/// How terms that a drift lacks are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissingChoice {
    /// Probability of naming anything where nothing is missing.
    pub false_alarm: f64,
    /// Terms named at most.
    pub most: usize,
}

/// The form of the diffusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DiffusionChoice {
    /// Any covariance.
    #[default]
    Full,
    /// Independent noise of every equation.
    Diagonal,
    /// Independent noise of one size.
    Isotropic,
}

/// What is known of the errors of the measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeasuredChoice {
    /// There are none.
    None,
    /// The residuals say whether they matter.
    #[default]
    Auto,
    /// Their standard deviation, of every state.
    Known(f64),
}

/// A reduced model: every coefficient as an expression of fewer unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedChoice {
    /// The unknowns with the values that the search starts from.
    pub start: Vec<(String, f64)>,
    /// Names for parts of the expressions, each of which may use those before it.
    pub define: Vec<(String, String)>,
    /// The coefficients by name; one that is not here is zero.
    pub coefficients: Vec<(String, String)>,
}

/// How a recording is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowChoice {
    /// Steps from one answer to the next.
    pub block: usize,
    /// Blocks that are tested for a change.
    pub recent: usize,
    /// Blocks that the estimate remembers; `None` for all.
    pub window: Option<usize>,
    /// Steps before the first test.
    pub least: usize,
    /// Probability of a false alarm of the tests of one block.
    pub rate: f64,
}

impl Default for FollowChoice {
    fn default() -> Self {
        Self { block: 100, recent: 1, window: None, least: 1000, rate: 1e-6 }
    }
}

/// A recording that is read block by block.
#[derive(Clone, Debug, PartialEq)]
pub struct InferRecord {
    /// Name, unique in the study.
    pub name: String,
    /// The file.
    pub file: PathBuf,
    /// Column of times.
    pub time: String,
    /// Columns of the states and then of the inputs, in the order of the model.
    pub columns: Vec<String>,
    /// Span that is used, both ends included.
    pub span: [f64; 2],
}
