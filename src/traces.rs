//! Where a process of this program writes its spans.

use starlings_traces::{Target, Traces};

use crate::failure::Failure;

/// Opens what `--traces` names, for a process in this role.
pub(crate) fn open_traces(target: &Target, role: &'static str) -> Result<Traces, Failure> {
    Traces::open(target, role, env!("CARGO_PKG_VERSION"))
        .map_err(|error| Failure::input(format!("--traces: {error}")))
}
