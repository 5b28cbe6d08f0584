//! Answers that nobody asked for: a few are the ends of races, many are a fault of the worker, which is put out.

use super::Dispatcher;
use super::message::{Command, WorkerId};

/// So many more than answers that were asked for.
const STRAYS: u32 = 100;

impl Dispatcher {
    /// Counts one.
    pub(super) fn stray(&mut self, id: WorkerId, reason: &str) {
        let Some(mut worker) = self.workers.get_mut(id) else { return };
        worker.strays += 1;
        let too_many = worker.strays > STRAYS;
        drop(worker);
        if too_many {
            self.out.push(Command::PutOut { worker: id, reason: reason.to_owned() });
            self.lose(id, reason, true);
        }
    }
}
