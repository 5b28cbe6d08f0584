//! The way of a fleet's events: to people, and on to the store.

use std::sync::{Arc, mpsc};

use starlings_coordinator::fleet::FleetEvent;

use super::repeated::Repeated;
use crate::log;
use crate::progress::Display;

/// Where events are shown.
pub(super) struct Shown {
    pub(super) display: Arc<Display>,
    /// Name of the run.
    pub(super) run: String,
    /// Whether workers come from elsewhere.
    pub(super) listens: bool,
}

/// Shows the events that people should see at once, runs that fail alike in one line at the end, and hands all of them on to the store. Where workers come from elsewhere, people
/// see who comes and goes.
pub(super) fn relay(
    heard: mpsc::Receiver<FleetEvent>,
    kept: &mpsc::Sender<FleetEvent>,
    Shown { display, run, listens }: &Shown,
    missing: impl Fn() -> [Option<String>; 2],
) {
    let mut repeated = Repeated::default();
    for event in heard {
        display.heard(&event);
        let is_notable = || event.is_notable() || *listens && event.is_of_roster();
        if log::is_json() || is_notable() && !repeated.is_known(&event) {
            let waits = matches!(event, FleetEvent::Waiting { .. });
            let more = missing().into_iter().flatten().filter(|_| waits);
            let said: Vec<String> = std::iter::once(event.to_string()).chain(more).collect();
            let said = said.join("; ");
            if log::is_json() {
                log::fleet(run, &event, &said);
            } else {
                display.say(&said);
            }
        } else {
            tracing::info!(kind = event.kind(), "{event}");
        }
        if event.is_lasting() {
            // The store stops listening at the end of the run; later events have no reader.
            let _ = kept.send(event);
        }
    }
    repeated.told().for_each(|line| display.say(&line));
}
