//! The fit: how a study's windows become ensembles on the fleet, and ensembles a posterior.
//!
//! [`filter`] runs the sequential passes that [`schedule`] lays out until they [`settle`], and [`batch`] the whole-record
//! iterations; both send their particles through [`runner`]; [`rescue`] and [`resample`] are what the filter does when points
//! fail or carry more spread than an affine map can; [`free_run`] runs the estimate freely at the end. The arithmetic is in
//! `starlings-estimators`. Next file to read: [`filter`].

pub(crate) mod batch;
mod drifting;
mod ensemble;
pub(crate) mod filter;
pub(crate) mod free_run;
mod index;
mod journal;
mod kept;
pub(crate) mod replay;
pub(crate) mod resample;
pub(crate) mod rescue;
pub(crate) mod results;
pub(crate) mod runner;
mod schedule;
pub(crate) mod settle;
mod slopes;
pub(crate) mod stack;
mod timeouts;
mod walking;

pub use settle::LIMIT;
