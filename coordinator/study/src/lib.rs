//! Studies: how they are read and checked, the loop that runs them, and the store that keeps every step.
//!
//! The data path: a study file becomes a checked [`Study`]; [`run::run`] sends its windows to a fleet and its
//! predictions to an estimator; every step goes to the [`store`], from which the summary and the report are made. Next
//! files to read: [`mod@run`], then [`fit`].

mod check;
pub mod checked;
pub mod constants;
pub mod diagnosis;
mod distances;
mod expand;
mod failures;
pub mod field;
mod file;
mod fit;
pub mod forecast;
#[cfg(fuzzing)]
pub mod fuzzing;
mod given_residuals;
pub mod identify;
pub mod infer_choice;
mod observer_gain;
mod plan;
pub mod posterior;
pub mod predicted;
mod predictive;
mod problem;
pub mod progress;
mod record;
pub mod replay;
mod room;
pub mod run;
mod run_error;
pub mod run_key;
mod solver_host;
pub mod spectrum;
pub mod states;
pub mod store;
pub mod summary;
pub mod surfaces;
pub mod trial;
pub mod twin;
pub mod variant;
mod warnings;
mod work;

pub use checked::{EstimatorChoice, FleetChoice, Record, Study, ThetaEntry};
pub use failures::{FailedRange, FailureCluster};
pub use file::memory::bytes_of;
pub use fit::LIMIT as MAX_PASSES;
pub use identify::words::listed;
pub use observer_gain::ObserverCourse;
pub use problem::{Problem, StudyError};
pub use progress::{Progress, Stage};
pub use run::{Fit, Move, RunContext};
pub use run_error::RunError;
pub use solver_host::{SolverHost, Undescribed};
pub use states::recombine_by;
pub use store::folder::{FolderError, RunFolder};
pub use summary::Summary;
pub use warnings::{CORRELATED, FAR_FROM_PRIOR};
pub use work::{Part, Takes, Work};
