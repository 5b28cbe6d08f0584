//! The study: what is asked, the loop that answers it, and the store that keeps every step.
//!
//! The data path: a study file becomes a checked [`Study`]; [`run`](run::run) sends its windows to a fleet and its
//! predictions to an estimator; every step goes to the [`store`], from which the summary and the report are made. Next
//! files to read: [`run`], then [`filter`].

pub mod batch_fit;
pub mod filter;
pub mod flight;
pub mod folder;
pub mod forecast;
pub mod posterior;
pub mod resample;
pub mod rescue;
pub mod run;
pub mod snapshot;
pub mod store;
pub mod summary;
pub mod trial;
pub mod twin;
pub mod warnings;

pub use folder::{FolderError, RunFolder};
pub use run::{Fit, Progress, RunContext, RunError};
pub use summary::Summary;
