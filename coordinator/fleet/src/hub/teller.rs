//! Events on their way out: what happens too often is counted and told in one.
//!
//! Workers cause events, and one that joins and leaves a thousand times a second must not fill a disk. Every kind has a store of
//! tellings that fills up again with time; beyond it events are counted. The count is told with the next one of the kind that is
//! told, with one that comes a minute or more after the first that was counted, or at the end. What says how a job ended is never left out.

use std::collections::BTreeMap;
use std::sync::mpsc::Sender;
use std::time::Duration;

use crate::FleetEvent;

/// Events of one kind that may be told at once.
const BURST: f64 = 200.0;

/// And that become free again each second.
const PER_SECOND: f64 = 0.5;

/// After so long the number of untold events is told.
const SUMMARY: Duration = Duration::from_secs(60);

/// The way of the events.
pub(super) struct Teller {
    events: Sender<FleetEvent>,
    kinds: BTreeMap<&'static str, Kind>,
}

struct Kind {
    left: f64,
    filled: Duration,
    untold: u64,
    last: String,
    since: Duration,
}

impl Teller {
    pub(super) fn new(events: Sender<FleetEvent>) -> Self {
        Self { events, kinds: BTreeMap::new() }
    }

    /// Tells an event, or counts it.
    pub(super) fn tell(&mut self, now: Duration, event: FleetEvent) {
        if is_spared(&event) {
            let _ = self.events.send(event);
            return;
        }
        let new = || Kind { left: BURST, filled: now, untold: 0, last: String::new(), since: now };
        let name = event.kind();
        let kind = self.kinds.entry(name).or_insert_with(new);
        let passed = now.saturating_sub(kind.filled).as_secs_f64();
        (kind.left, kind.filled) = ((kind.left + PER_SECOND * passed).min(BURST), now);
        if kind.left >= 1.0 {
            kind.left -= 1.0;
            let untold = kind.summary(name, now);
            let _ = self.events.send(event);
            untold.map(|untold| self.events.send(untold));
            return;
        }
        if kind.untold == 0 {
            kind.since = now;
        }
        kind.untold += 1;
        kind.last = event.to_string();
        if now.saturating_sub(kind.since) >= SUMMARY {
            kind.summary(name, now).map(|untold| self.events.send(untold));
        }
    }

    /// Tells what was only counted, as at the end.
    pub(super) fn tell_rest(&mut self, now: Duration) {
        for (name, kind) in &mut self.kinds {
            kind.summary(name, now).map(|untold| self.events.send(untold));
        }
    }
}

impl Kind {
    fn summary(&mut self, name: &str, now: Duration) -> Option<FleetEvent> {
        let (count, last) = (std::mem::take(&mut self.untold), std::mem::take(&mut self.last));
        self.since = now;
        (count > 0).then(|| FleetEvent::Untold { of: name.to_owned(), count, last })
    }
}

/// How jobs ended is data of the run; how far it is, is kept nowhere; there is one address.
fn is_spared(event: &FleetEvent) -> bool {
    matches!(
        event,
        FleetEvent::Progress { .. }
            | FleetEvent::JobFailed { .. }
            | FleetEvent::Listening { .. }
            | FleetEvent::OtherBuild { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_events_is_told_as_a_number_and_a_trickle_one_by_one() {
        let (sender, told) = std::sync::mpsc::channel();
        let mut teller = Teller::new(sender);
        let event = |n: u64| FleetEvent::LateAnswer { worker: "w".to_owned(), job: n };
        for n in 0..100_000 {
            teller.tell(Duration::from_micros(n), event(n));
        }
        teller.tell_rest(Duration::from_secs(1));
        let events = told.try_iter().collect::<Vec<_>>();
        assert_eq!(events.len(), 201);
        let Some(FleetEvent::Untold { of, count: 99_800, last }) = events.last() else {
            panic!("{events:?}")
        };
        assert!(of == "late-answer" && last.contains("99999"), "{last}");
        for n in 0..1000 {
            teller.tell(Duration::from_secs(1000 + 3 * n), event(n));
        }
        assert_eq!(told.try_iter().count(), 1000);
    }
}
