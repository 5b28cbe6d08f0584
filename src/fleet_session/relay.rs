//! The way of a fleet's events: to people, and on to the store.

use std::sync::mpsc;

use starlings_coordinator::fleet::FleetEvent;

use crate::progress::Display;

/// Shows the events that people should see at once and hands all of them on to the store. Where workers come from elsewhere, people
/// see who comes and goes.
pub(super) fn relay(
    heard: mpsc::Receiver<FleetEvent>,
    kept: &mpsc::Sender<FleetEvent>,
    display: &Display,
    listens: bool,
    missing: impl Fn() -> [Option<String>; 2],
) {
    for event in heard {
        if event.is_notable() || listens && event.is_of_roster() {
            let waits = matches!(event, FleetEvent::Waiting { .. });
            let more = missing().into_iter().flatten().filter(|_| waits);
            let said: Vec<String> = std::iter::once(event.to_string()).chain(more).collect();
            display.say(&said.join("; "));
        } else {
            tracing::info!(kind = event.kind(), "{event}");
        }
        if event.is_lasting() {
            // The store stops listening at the end of the run; later events have no reader.
            let _ = kept.send(event);
        }
    }
}
