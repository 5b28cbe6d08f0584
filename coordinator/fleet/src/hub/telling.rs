//! What is told on, beyond the events themselves: to a worker what is thought of it, to a waiting caller who was turned away.
//!
//! Next file to read: [`super::state`].

use starlings_proto::ToWorker;

use super::state::State;
use crate::FleetEvent;
use crate::dispatcher::WorkerId;

impl State {
    /// Tells of an event, and who else it concerns.
    pub(super) fn notify(&mut self, mut event: FleetEvent) {
        match &mut event {
            FleetEvent::WorkerSetAside { worker, .. } | FleetEvent::WorkerBack { worker } => {
                let worker = worker.clone();
                if let Some(link) = self.links.values().find(|link| link.name == worker) {
                    link.outbox.send(ToWorker::notice(&event.to_string()));
                }
            }
            FleetEvent::WorkerRefused { host, reason } => {
                self.doorway.refused = Some(format!("from {host}: {reason}"));
            }
            FleetEvent::Waiting { missing, .. } => {
                if let (true, Some(address)) = (self.links.is_empty(), self.doorway.address) {
                    missing.push_str(" at ");
                    missing.push_str(&address.to_string());
                }
                missing.push_str(&self.turned_away());
            }
            _ => {}
        }
        self.tell(event);
    }

    /// Who was turned away, where nobody else is there.
    pub(super) fn turned_away(&self) -> String {
        match &self.doorway.refused {
            Some(refused) if self.links.is_empty() => {
                format!("; the last one that was refused came {refused}")
            }
            _ => String::new(),
        }
    }

    /// Ends a worker's session for good: it is told why, and its process is not taken again.
    pub(super) fn put_out(&mut self, worker: WorkerId, reason: &str) {
        let Some(link) = self.links.remove(&worker) else { return };
        link.outbox.send(ToWorker::drain(reason));
        self.excluded.add(link.nonce, reason);
        // What it answered is made again.
        let Self { states, dispatcher, .. } = self;
        states.keep_needed(|id| dispatcher.needs_state(id));
    }
}
