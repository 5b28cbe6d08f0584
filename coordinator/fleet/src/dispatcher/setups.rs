//! What workers say of the setups that they were sent.
//!
//! Next file to read: [`super::roster`], which keeps what each has built.

use std::time::Duration;

use starlings_proto::SetupId;

use super::Dispatcher;
use super::message::{Command, WorkerId};
use super::roster::SetupState;
use crate::FleetEvent;

impl Dispatcher {
    pub(super) fn setup_answered(&mut self, now: Duration, id: WorkerId, setup: SetupId, state: SetupState) {
        let Some(mut worker) = self.workers.get_mut(id) else { return };
        worker.last_heard = now;
        let needed = self.batch.as_ref().is_some_and(|batch| batch.needs(&setup));
        if worker.answers_unasked(&setup, &state) {
            drop(worker);
            return self.stray(id, "it speaks of setups that it was not sent, again and again");
        }
        if let SetupState::Failed(reason) = &state {
            if worker.is_ready(&setup) {
                // It had built it: its cache was full.
                worker.setups.remove(&setup);
                if needed && worker.wants(setup, now) {
                    self.out.push(Command::SendSetup { worker: id, setup });
                }
                return;
            }
            let notice = FleetEvent::SetupFailed { worker: worker.name.clone(), reason: reason.clone() };
            self.out.push(Command::Notice(notice));
        }
        worker.setup_answered(setup, state, now);
    }
}
