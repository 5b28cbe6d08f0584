//! Dynamical inference: drift and noise of stochastic equations from recordings, with the sums made on the fleet.
//!
//! | file | what it does |
//! |---|---|
//! | [`error`] | why there is no inference |
//! | `rows`, `even_step`, `resampled`, `blocks` | a recording row by row, at equal steps, and cut into blocks, in memory that does not grow with it |
//! | `parts`, `file_blocks` | the same blocks as bytes of its file, which workers read |
//! | `gather` | has the sums of every block made as jobs and merges them in block order |
//! | `convergence` | the estimate after each power of two of blocks |
//! | `smoothed` | the same from a smoothed path, where the measurement's noise is known |
//! | `hidden`, `coarse` | whether errors of the measurement, or the recording's steps, are in the way |
//! | `doubts`, `varying`, `constancy` | what else is doubtful of a recording: noise that is not constant, coefficients that change |
//! | `strays` | single values that stand apart from the rows around them |
//! | `missing` | which terms the drift lacks, among candidates |
//! | [`explained`](mod@explained) | what was found of missing terms as an explanation |
//! | [`reduced`] | a model with fewer unknowns than coefficients |
//! | `fitted` | a fit, with what its residuals say of the measurement |
//! | [`result`], `answer`, `words` | the tables with intervals, and what is said of them |
//! | [`follow`](mod@follow) | a recording that is still written: estimates and alarms as it arrives |
//! | [`forecast`](mod@forecast) | an ensemble of what comes next, drawn from the posterior |
//! | `progress` | where it stands, while it works |
//! | [`run`] | all of it on a page |
//!
//! The mathematics is in the estimators; nothing here computes a posterior. Next file to read: [`mod@run`].

mod answer;
mod blocks;
mod coarse;
mod constancy;
mod convergence;
mod doubts;
pub mod error;
mod even_step;
pub mod explained;
mod file_blocks;
mod fitted;
pub mod follow;
pub mod forecast;
mod gather;
mod hidden;
mod missing;
mod noise_words;
mod outlook;
mod parts;
mod progress;
pub mod reduced;
mod resampled;
pub mod result;
mod rows;
pub mod run;
mod share;
mod smoothed;
mod strays;
mod varying;
mod words;

pub use error::InferError;
pub use outlook::{Outlook, outlook};
pub use progress::Progress;
pub use result::Inference;
pub use run::{Reader, check, infer};
