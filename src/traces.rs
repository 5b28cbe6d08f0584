//! Where a process of this program writes its spans.

use starlings_coordinator::fleet::RunTraces;
use starlings_traces::{Span, Target, Traces};

use crate::failure::Failure;

/// Opens what `--traces` names, for a process in this role.
pub(crate) fn open_traces(target: &Target, role: &'static str) -> Result<Traces, Failure> {
    Traces::open(target, role, env!("CARGO_PKG_VERSION"))
        .map_err(|error| Failure::input(format!("--traces: {error}")))
}

/// The span of a command that drives a fleet, and where spans go.
pub(crate) struct Traced {
    traces: Traces,
    span: Span,
}

impl Traced {
    pub(crate) fn begin(traces: Traces, study: &str) -> Self {
        let span = traces.begin("study", None, [("starlings.study", study.to_owned().into())]);
        Self { traces, span }
    }

    /// Spans of runs, below that of the command.
    pub(crate) fn for_runs(&self) -> RunTraces {
        RunTraces { traces: self.traces.clone(), above: self.span.parent() }
    }

    /// Ends the span and writes what is gathered.
    pub(crate) fn end(self) {
        self.span.end();
        self.traces.close();
    }
}
