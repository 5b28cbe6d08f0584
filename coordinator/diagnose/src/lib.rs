//! Whether a recording shows a fault, since when, and which scenario of a library it followed.
//!
//! | file | what it does |
//! |---|---|
//! | [`error`] | why there is no diagnosis |
//! | `runs` | what was measured, and runs of several models over it on the fleet |
//! | `foreseen` | how many runs there will be |
//! | `hypothesis` | a model with its fit: the one without a fault, or a scenario |
//! | `search` | where the fit of a scenario with a grid of starts begins |
//! | `alarm` | whether the recording departs from the model without a fault, at the stated rate of false alarms |
//! | [`result`], `words` | the answer, and what is said of it |
//! | [`run`] | all of it on a page |
//!
//! The studies come checked from `starlings_study::diagnosis`; the mathematics is `departures.rs` and `scenarios.rs` of the estimators.
//! Next file to read: [`mod@run`].

mod alarm;
pub mod error;
mod foreseen;
mod hypothesis;
pub mod result;
pub mod run;
mod runs;
mod search;
mod words;

pub use error::DiagnoseError;
pub use result::Diagnosed;
pub use run::diagnose;
