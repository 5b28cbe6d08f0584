//! The study: what is asked, the loop that answers it, and the store that keeps every step.
//!
//! The data path: a study file becomes a checked [`Study`]; [`run`](run::run) sends its windows to a fleet and its
//! predictions to an estimator; every step goes to the [`store`], from which the summary and the report are made. Next
//! files to read: [`run`], then [`filter`].

pub mod batch_fit;
mod check;
mod check_blame;
mod check_model;
mod check_parameters;
mod check_settings;
pub mod checked;
mod expand;
pub mod file;
mod file_model;
mod file_read;
mod file_table;
pub mod filter;
pub mod flight;
pub mod folder;
pub mod forecast;
mod locate;
mod plan;
pub mod posterior;
mod prior;
pub mod problem;
mod record;
mod record_channel;
mod record_csv;
mod record_input;
pub mod resample;
pub mod rescue;
pub mod run;
pub mod snapshot;
pub mod store;
pub mod summary;
pub mod trial;
pub mod twin;
pub mod warnings;

pub use checked::{EstimatorChoice, EstimatorKind, FleetChoice, Record, Study, ThetaEntry};
pub use folder::{FolderError, RunFolder};
pub use problem::{Problem, StudyError};
pub use run::{Fit, Progress, RunContext, RunError};
pub use summary::Summary;
