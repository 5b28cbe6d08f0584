//! A checked study: plain data that the run uses without further checks.
//!
//! Nothing here reads files or checks: [`super::check`] does. Next files to read: [`super::expand`] for the way from the
//! estimated vector to a job's values, [`super::plan`] for the windows.

mod asked;

use std::path::PathBuf;
use std::sync::Arc;

use starlings_estimators::{Drift, Kind, Options, Points, Root, Transform};
use starlings_models::{EffectDef, Setup, Signal, Spec};

pub use self::asked::{ExplainChoice, Library, PROPOSALS, PredictChoice, SpectrumChoice};
use super::infer_choice::InferChoice;
use super::solver_host::SolverHost;
use super::surfaces::Node;

/// A study whose names exist, whose numbers make sense and whose recordings were read.
#[derive(Clone, Debug)]
pub struct Study {
    /// The study file.
    pub file: PathBuf,
    /// Its text, as read.
    pub text: Arc<str>,
    /// Name of the study.
    pub name: String,
    /// What it is about, in the author's words.
    pub says: String,
    /// Every random choice derives from it.
    pub seed: u64,
    /// Unit label of every time.
    pub time_unit: String,
    /// What workers receive: its parameters are the values of a job, its outputs those of all channels, first seen first.
    pub setup: Setup,
    /// Description of the model with its effects.
    pub spec: Spec,
    /// Effects that the file describes and that are not part of the model: none of their parameters has a value.
    pub candidates: Arc<Vec<EffectDef>>,
    /// The uncertain parameters, in the order of [`Setup::parameters`].
    pub parameters: Vec<StudyParameter>,
    /// The estimated vector: shared parameters once, the others once per trained record.
    pub theta: Vec<ThetaEntry>,
    /// The recordings, which variants of the study share.
    pub records: Arc<Vec<Record>>,
    /// The estimator.
    pub estimator: EstimatorChoice,
    /// The fleet.
    pub fleet: FleetChoice,
    /// What `explain` may do.
    pub explain: ExplainChoice,
    /// What `spectrum` compares.
    pub spectrum: SpectrumChoice,
    /// What `run` predicts after the fit.
    pub predict: PredictChoice,
    /// What `infer` asks, where the file says so and the study was read for it.
    pub infer: Option<Arc<InferChoice>>,
    /// An input is used at earlier times: windows then hold it from the record's start.
    pub delays: bool,
    /// Whether the model can be run in this process; a solver that a file describes may be on another machine.
    pub runs_here: bool,
    /// Whether every run covers a whole record, since the solver answers for nothing less; found by a dry run.
    pub whole_answers: bool,
    /// What the rounding of the solver's outputs is worth; the trial finds it.
    pub rounding: Rounding,
    /// Starts its solver, where the model is one.
    pub solver_host: SolverHost,
    /// What is doubtful in what takes part in every run, but no error.
    pub warnings: Vec<String>,
    /// What is doubtful in a candidate, by its name; it counts where the candidate is tried.
    pub candidate_warnings: Vec<(String, String)>,
}

/// An uncertain parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyParameter {
    /// Name in the model, or `initial:<state>`.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Map to the units in which the prior is Gaussian.
    pub transform: Transform,
    /// One value per record instead of one for all.
    pub per_record: bool,
    /// Prior mean in transformed units, one per record of the study.
    pub prior_mean: Vec<f64>,
    /// Prior standard deviation in transformed units.
    pub prior_sd: f64,
    /// How it moves from one analysis to the next.
    pub drift: Drift,
}

/// One entry of the estimated vector.
#[derive(Clone, Debug, PartialEq)]
pub struct ThetaEntry {
    /// `R`, or `R[in-vivo-1]` for one record's value.
    pub name: String,
    /// Index in [`Study::parameters`].
    pub parameter: usize,
    /// Index in [`Study::records`]; `None` when all records share the value.
    pub record: Option<usize>,
    /// Prior mean in transformed units.
    pub prior_mean: f64,
    /// Prior standard deviation in transformed units.
    pub prior_sd: f64,
    /// Map to physical units.
    pub transform: Transform,
    /// How it moves from one analysis to the next.
    pub drift: Drift,
}

/// How coarse the outputs of a solver are beside the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Rounding {
    /// Sum of the variances of rounding over those of the noise, over the fitted values, per sigma point; zero where nothing is rounded.
    pub variances: f64,
    /// Whether the study says how far apart sigma points are.
    pub is_spread_given: bool,
    /// Width of the points of a fit in the place of [`EstimatorChoice::spread`]; `None` where that is wide enough, or given.
    pub spread: Option<f64>,
}

/// A recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name, unique in the study.
    pub name: String,
    /// Where the run starts: at the first of the times, or before it.
    pub start: f64,
    /// Times at which at least one channel was measured, strictly increasing.
    pub times: Vec<f64>,
    /// What was measured.
    pub channels: Vec<Channel>,
    /// Input signals in the order of the model's inputs, as long as their file.
    pub inputs: Vec<Signal>,
    /// Training span, both ends included; `None` when the whole record is held out.
    pub train: Option<[f64; 2]>,
    /// Whether the training span is that of the first rows of a held-out record, which are there to find its initial values.
    pub only_start: bool,
    /// Observation times per window.
    pub every: usize,
}

/// One measured output of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The model's output.
    pub output: String,
    /// Its position in [`Setup::outputs`].
    pub row: usize,
    /// Column of the record's file.
    pub column: String,
    /// Unit label of its values where the study gives one; else the output's stands for it.
    pub unit: Option<String>,
    /// Standard deviation of the noise, in the channel's unit.
    pub noise: f64,
    /// How that standard deviation was found.
    pub noise_how: String,
    /// Number of third differences from which it was found; `None` where the study gives it.
    pub noise_found_from: Option<usize>,
    /// Values at the record's times; NaN where missing.
    pub values: Vec<f64>,
    /// Never fitted.
    pub held_out: bool,
    /// Where the output is compared with a surface per time, the node that it displaces.
    pub node: Option<Node>,
}

/// The estimator and its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorChoice {
    /// Which one.
    pub kind: &'static Kind,
    /// Sigma points.
    pub points: Points,
    /// Root of the covariance that moves the particles.
    pub root: Root,
    /// Passes of the filter over the data; `None` for as many as the estimate takes to settle.
    pub passes: Option<usize>,
    /// Factor on the noise sd in the first of several passes.
    pub anneal: f64,
    /// Width of the sigma points: of the prior sd from the filter's second pass on, of the posterior sd in the batch fit.
    pub spread: f64,
    /// Resample states and parameters before an analysis, for sets of more than p + 1 points.
    pub resample: bool,
    /// Ensembles of the batch fit at most.
    pub max_iterations: usize,
    /// Step at which the batch fit has converged, in posterior sd.
    pub tolerance: f64,
}

/// Workers, and how long to wait for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FleetChoice {
    /// Local worker processes.
    pub workers: usize,
    /// Runs at a time per local worker; `None` is one.
    pub slots: Option<usize>,
    /// Seconds to wait while no worker can take a run; `None` for the fleet's own default.
    pub patience: Option<f64>,
    /// Workers that may be lost under one run before the study ends; `None` for the fleet's own default.
    pub max_attempts: Option<u32>,
    /// A run that takes so many times the usual time is given up; `None`: none is.
    pub timeout_factor: Option<f64>,
}

impl Study {
    /// Width of the sigma points of a fit, as [`EstimatorChoice::spread`].
    pub fn spread(&self) -> f64 {
        self.rounding.spread.unwrap_or(self.estimator.spread)
    }

    /// Whether no observer corrects the state during a run.
    pub fn observer_is_off(&self) -> bool {
        self.setup.observer.is_off()
    }

    /// Whether a parameter moves from one analysis to the next.
    pub fn drifts(&self) -> bool {
        self.theta.iter().any(|t| !matches!(t.drift, Drift::None))
    }

    /// Number of passes of the filter where it is fixed; a study with a drifting parameter has two at most.
    pub fn passes(&self) -> Option<usize> {
        let given = self.estimator.passes;
        if self.drifts() { Some(given.map_or(2, |n| n.min(2))) } else { given }
    }

    /// The estimator in one line, such as `roukf, simplex points, 2 passes`.
    pub fn describe_estimator(&self) -> String {
        self.describe_with(self.passes())
    }

    /// The same with the number of passes that were made.
    pub(crate) fn describe_with(&self, passes: Option<usize>) -> String {
        if self.estimator.kind.has_exact_slopes() {
            return format!("{}, exact slopes", self.estimator.kind.name);
        }
        let points = match self.estimator.points {
            Points::Simplex => "simplex",
            Points::Canonical => "canonical",
            Points::Star => "star",
            Points::JulierUhlmann { .. } => "julier-uhlmann",
        };
        let passes = match passes {
            _ if !self.estimator.kind.is_filter() => String::new(),
            None => ", passes until the estimate has settled".to_owned(),
            Some(1) => ", 1 pass".to_owned(),
            Some(n) => format!(", {n} passes"),
        };
        format!("{}, {points} points{passes}", self.estimator.kind.name)
    }

    /// What the study's filter is made from, without drift.
    pub fn filter_options(&self) -> Options {
        let (points, root) = (self.estimator.points, self.estimator.root);
        Options { n_param: self.theta.len(), points, root, seed: self.seed }
    }

    /// Noise sd of each of [`Setup::outputs`] in a record; 1 for an output that the record does not measure, whose rows
    /// are all missing.
    pub fn noise(&self, record: usize) -> Vec<f64> {
        let mut noise = vec![1.0; self.setup.outputs.len()];
        for channel in &self.records[record].channels {
            noise[channel.row] = channel.noise;
        }
        noise
    }
}

impl Record {
    /// Whether the record takes part in the fit.
    pub fn is_trained(&self) -> bool {
        self.train.is_some()
    }

    /// The training span cut to the record, `None` when the whole record is held out.
    pub fn train_span(&self) -> Option<[f64; 2]> {
        let [from, to] = self.train?;
        Some([from.max(*self.times.first()?), to.min(*self.times.last()?)])
    }

    /// Whether the time lies in the training span.
    pub fn trains_at(&self, time: f64) -> bool {
        self.train.is_some_and(|[from, to]| from <= time && time <= to)
    }

    /// The value of one of the record's channels at one of its times, if it was measured there.
    pub fn observed(&self, channel: &Channel, time: f64) -> Option<f64> {
        let at = self.times.binary_search_by(|t| t.total_cmp(&time)).ok()?;
        channel.values.get(at).copied().filter(|v| v.is_finite())
    }
}
