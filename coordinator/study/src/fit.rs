//! The fit: how a study's windows become ensembles on the fleet, and ensembles a posterior.
//!
//! [`filter`] runs the sequential passes that [`schedule`] lays out until they [`settle`], and [`batch`] the whole-record iterations; both send their particles through
//! [`runner`]; [`rescue`] and [`resample`] are what the filter does when points fail or carry more spread than an affine map
//! can; [`free_run`] runs the estimate freely at the end. The arithmetic is in `starlings-estimators`. Next file to read:
//! [`filter`].

pub mod batch;
mod ensemble;
pub mod filter;
pub mod free_run;
pub mod resample;
pub mod rescue;
pub mod runner;
mod schedule;
pub mod settle;
pub mod stack;
mod timeouts;

pub use ensemble::recombine_by;
