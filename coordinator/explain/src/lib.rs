//! Explaining a misfit: where simulation and data disagree, which effect is missing, and by how much it narrows the gap.
//!
//! Every decision is made by running the model again, never by differentiating data. The folders are the steps, and each sees
//! only those above it:
//!
//! | step | what it does |
//! |---|---|
//! | [`error`], [`options`], [`rows`], [`number`] | what all steps share: the measured values as rows, figures in words |
//! | [`locate`] | where residuals disagree with the noise, and what they go along with |
//! | [`run_cache`] | runs variants of the model on the fleet and remembers every run |
//! | [`fit`] | model variants with effects added or terms left out, and their least-squares fits |
//! | [`screen`] | the effects to try, and the first-order score of each at a finished fit |
//! | [`judge`] | what chance would give, the gates, held-out data, the form of an effect, the verdict |
//! | [`refit`] | the search: refits the best candidates, has them judged, replaces and pairs them in a second pass |
//! | [`tell`] | the result with its sentences, figures and warnings, the study with the effects in it, storage |
//! | [`rounds`], [`diagnosis`], [`null_recordings`], [`run`] | all steps on one set of recordings, on simulated ones, and the whole workflow |
//!
//! The search asks for a judgement of every refit before it goes on, and so [`refit`] stands below [`judge`]. Next file to read:
//! [`run`].

mod diagnosis;
mod error;
mod fit;
mod judge;
pub mod locate;
mod null_recordings;
mod number;
mod options;
mod refit;
mod rounds;
mod rows;
mod run;
mod run_cache;
mod screen;
mod tell;

pub use error::ExplainError;
pub use fit::drive::drive;
pub use fit::fitted_variant::FittedVariant;
pub use fit::kind::Kind;
pub use judge::held_out::HeldOut;
pub use judge::probability::{Probabilities, ProbableSet};
pub use judge::verdict::Verdict;
pub use options::{Context, Options};
pub use rows::Rows;
pub use run::explain;
pub use run_cache::{Point, RunCache};
pub use screen::candidates::{candidates, check};
pub use screen::not_tried::NotTried;
pub use tell::figures::{Curve, Figures};
pub use tell::findings::{Findings, load_findings, save_findings};
pub use tell::patch::drift::{DriftTerm, explained_drift};
pub use tell::patch::{PatchEffect, PatchError, explained_study};
pub use tell::result;
pub use tell::result::Explanation;
