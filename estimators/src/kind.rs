//! The description of an estimator: its name in a study file, the settings that it reads, and how it goes through the data.
//!
//! A filter in the list [`crate::KINDS`] needs nothing else: its name is valid in a study file, and the loop over windows runs
//! it. No arithmetic here. Read next: `filter.rs`, then `roukf.rs`.

use std::fmt;

use crate::{EstimatorError, Filter, Points, Root};

/// An estimator as a study file names it.
pub struct Kind {
    /// Its `kind` in a study file.
    pub name: &'static str,
    /// Keys of the section that it reads.
    pub keys: &'static [&'static str],
    /// Width of its points unless the study says otherwise.
    pub spread: f64,
    /// How it goes through the data.
    pub form: Form,
}

/// How an estimator goes through the data.
#[derive(Debug)]
pub enum Form {
    /// From window to window, on particles that go on from the states of the last analysis.
    Windows(MakeFilter),
    /// Over whole records, each run from its start.
    WholeRecords(Slope),
}

/// How a fit of whole records knows the slope of the predictions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slope {
    /// From sigma points around the centre, a run each.
    Points,
    /// From the model's own derivatives, which one run at the centre gives.
    Exact,
}

/// Makes a filter.
pub type MakeFilter = fn(&Options) -> Result<Box<dyn Filter>, EstimatorError>;

/// What a filter is made from.
#[derive(Debug, Clone)]
pub struct Options {
    /// Number of parameters p.
    pub n_param: usize,
    /// Which points.
    pub points: Points,
    /// Root of the posterior covariance.
    pub root: Root,
    /// The study's seed, for a filter that draws its particles.
    pub seed: u64,
}

impl Kind {
    /// Whether it goes from window to window, on states that the model restarts from.
    pub fn is_filter(&self) -> bool {
        matches!(self.form, Form::Windows(_))
    }

    /// Whether its runs give the derivatives of what they predict.
    pub fn has_exact_slopes(&self) -> bool {
        matches!(self.form, Form::WholeRecords(Slope::Exact))
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Kind {}

impl fmt::Debug for Kind {
    /// The name alone: a digest of a study's settings must not depend on where a program was loaded.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}
