//! An estimated parameter as a report shows it: two intervals beside its prior.
//!
//! Deliberately without a choice of its own: which interval comes first is the reader's. Next file to read: [`super`].

use serde::{Deserialize, Serialize};

/// One estimated parameter. `sd`, `lo` and `hi` are of the interval that comes first, which every figure shows: at the stated
/// noise, or given the residuals. Both hold 95 %, in the parameter's own scale.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ParameterRow {
    /// Name in the study.
    pub(crate) name: String,
    /// Unit; empty for a pure number.
    pub(crate) unit: String,
    /// Posterior estimate.
    pub(crate) estimate: f64,
    /// Posterior standard deviation.
    pub(crate) sd: f64,
    /// Lower end of the posterior 95 % interval.
    pub(crate) lo: f64,
    /// Upper end of the posterior 95 % interval.
    pub(crate) hi: f64,
    /// The other interval, lower and upper end; `None` when there is only one.
    pub(crate) other: Option<[f64; 2]>,
    /// Prior median.
    pub(crate) prior_median: f64,
    /// Lower end of the prior 95 % interval.
    pub(crate) prior_lo: f64,
    /// Upper end of the prior 95 % interval.
    pub(crate) prior_hi: f64,
}
