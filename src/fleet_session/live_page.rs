//! The page that follows a command while it runs.
//!
//! Next file to read: `coordinator/live/src/lib.rs`.

use std::path::Path;

use starlings_coordinator::fleet::Readings;
use starlings_coordinator::live::{Head, Live, LivePage};
use starlings_coordinator::metrics::Address;
use starlings_coordinator::study::Study;

use crate::console::note;
use crate::failure::Failure;
use crate::progress::Display;

/// Serves it, and says where.
pub(super) fn serve_page(
    at: Address,
    (study, command): (&Study, &str),
    (fleet, folder): (Readings, Option<&Path>),
    display: &Display,
) -> Result<LivePage, Failure> {
    let is_loopback = at.address.ip().is_loopback();
    let unit = |entry: &starlings_coordinator::study::ThetaEntry| {
        (entry.name.clone(), study.parameters[entry.parameter].unit.clone())
    };
    let head = Head {
        study: study.name.clone(),
        command: command.to_owned(),
        model: study.setup.model.kind.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        units: study.theta.iter().map(unit).collect(),
    };
    let live = Live::new(head, fleet, folder, display.clock()).map_err(Failure::run)?;
    display.show_on(live.clone());
    let page = LivePage::serve(at, live).map_err(Failure::run)?;
    note(format_args!("live page at {}", page.url()));
    if !is_loopback {
        note(
            "warning: --dashboard: the page is not encrypted: whoever reads the network on the way sees the run and its token; \
             ssh -L to a port of this machine alone hides both",
        );
    }
    Ok(page)
}

/// Ends the live page of a command that is done, and leads it to the report.
pub(crate) fn finish(page: Option<LivePage>, report: Option<&Path>) {
    if let Some(page) = page {
        page.finish(report);
    }
}
