//! An estimated parameter as a report shows it: two intervals beside its prior.
//!
//! Deliberately without a choice of its own: which interval comes first is the reader's. Next file to read: [`super`].

use serde::{Deserialize, Serialize};

/// One estimated parameter. `sd`, `lo` and `hi` are of the interval that comes first, which every figure shows: at the stated
/// noise, or given the residuals. Both hold 95 %, in the parameter's own scale.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ParameterRow {
    /// Name in the study.
    pub name: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Posterior estimate.
    pub estimate: f64,
    /// Posterior standard deviation.
    pub sd: f64,
    /// Lower end of the posterior 95 % interval.
    pub lo: f64,
    /// Upper end of the posterior 95 % interval.
    pub hi: f64,
    /// The other interval, lower and upper end; `None` when there is only one.
    pub other: Option<[f64; 2]>,
    /// Prior median.
    pub prior_median: f64,
    /// Lower end of the prior 95 % interval.
    pub prior_lo: f64,
    /// Upper end of the prior 95 % interval.
    pub prior_hi: f64,
}
