//! The fit: how a study's windows become ensembles on the fleet, and ensembles a posterior.
//!
//! [`filter`] runs the sequential passes that [`schedule`] lays out until they [`settle`], and [`batch`] the whole-record iterations; both send their particles through
//! [`flight`]; [`rescue`] and [`resample`] are what the filter does when points fail or carry more spread than an affine map
//! can; [`forecast`] runs the estimate freely at the end. The arithmetic is in `starlings-estimators`. Next file to read:
//! [`filter`].

pub mod batch;
mod ensemble;
pub mod filter;
pub mod flight;
pub mod forecast;
pub mod resample;
pub mod rescue;
mod schedule;
pub mod settle;
pub mod stack;
mod timeouts;

pub use ensemble::recombine_by;
