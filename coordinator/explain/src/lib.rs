//! Explaining a misfit: where simulation and data disagree, which effect is missing, and the gap shrinking.
//!
//! Every decision is made by running the model again, never by differentiating data: one candidate effect is one run, so the
//! screening is what the fleet is for. Next files to read: [`result`] for what comes out, [`rows`] for the common language.

mod adequacy;
mod again;
mod allowance;
mod answer;
mod background;
mod bent;
mod candidate;
pub mod candidates;
mod carried;
mod column;
mod course;
mod differences;
mod doubt;
mod experiment;
pub mod figures;
pub mod fit;
mod fitted;
mod form;
pub mod held_out;
mod influence;
mod influences;
mod inquiry;
mod judge;
pub mod keep;
pub mod laboratory;
pub mod locate;
mod memory;
pub mod misfit;
mod null;
pub mod options;
mod own_values;
pub mod patch;
mod probe;
pub mod reach;
mod recent;
mod refused;
pub mod result;
mod rhythm;
pub mod rows;
mod run;
mod screen;
mod search;
mod verdict;
pub mod version;
mod warnings;
mod words;

pub use figures::Figures;
pub use options::{Context, ExplainError, Findings, Options, Stage};
pub use result::{Explanation, Verdict};
pub use rows::{Row, Rows, Usage};
pub use run::explain;
