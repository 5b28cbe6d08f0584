//! Results on their way to a coordinator that is back: a portion at a time, read from the disk when its turn comes.
//!
//! Next file to read: [`super`].

use std::collections::VecDeque;
use std::sync::Arc;

use starlings_proto::{Bytes, HeldRun, JobKey};

use super::Held;

/// The results that were held when a coordinator came.
pub(crate) struct Delivery {
    held: Arc<Held>,
    /// Bytes of a portion, about.
    most: usize,
    memory: VecDeque<HeldRun>,
    /// The last one of the file that was read.
    last: Option<JobKey>,
}

impl Delivery {
    pub(super) fn new(held: Arc<Held>, most: usize, memory: VecDeque<HeldRun>) -> Self {
        Self { held, most, memory, last: None }
    }

    /// The next one.
    fn one(&mut self) -> Option<HeldRun> {
        if let Some(run) = self.memory.pop_front() {
            return Some(run);
        }
        let shared = self.held.lock();
        let key = shared.file.key_after(self.last.as_ref())?;
        match shared.file.read(&key) {
            Ok(ended) => {
                self.last = Some(key);
                Some(HeldRun { key, ended })
            }
            Err(error) => {
                tracing::warn!(
                    "results that were held on disk cannot be read, their runs are made again: {error}"
                );
                None
            }
        }
    }

    /// All of them have been sent.
    pub(crate) fn ended(self) {
        self.held.lock().file.was_sent();
    }
}

impl Iterator for Delivery {
    type Item = Vec<HeldRun>;

    fn next(&mut self) -> Option<Vec<HeldRun>> {
        let (mut portion, mut bytes) = (Vec::new(), 0);
        while bytes < self.most {
            let Some(run) = self.one() else { break };
            bytes += run.key.len() + run.ended.as_ref().map_or(0, Bytes::len);
            portion.push(run);
        }
        Some(portion).filter(|portion| !portion.is_empty())
    }
}
