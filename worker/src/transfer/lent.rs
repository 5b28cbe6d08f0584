//! End states by memory that the coordinator lent: asked for once, used again and again, given back where it is of no use.
//!
//! Whatever fails on this way, other than the state itself, leaves the way in pieces. Next file to read: [`super`].

use std::sync::{MutexGuard, PoisonError};

use starlings_pieces::{Mapped, SharedMemory};
use starlings_proto::StateId;
use starlings_proto::convert::lent::{GiveBack, Lend, NOT_LENT, encode_in_memory};
use starlings_proto::convert::state::PutHead;
use tonic::Status;

use super::{Transfers, taken};
use crate::pieces;

/// Memory for states of one length.
pub(super) struct LentMemory {
    /// The number under which it was lent.
    number: u64,
    n_state: usize,
    memory: SharedMemory,
    /// Its addresses, once the first state has made the system give its pages: where it has none left, that is an error and no signal.
    mapped: Option<Mapped>,
}

impl LentMemory {
    /// Writes a state into it.
    fn fill(&mut self, values: &[f64]) -> std::io::Result<()> {
        if let Some(mapped) = &self.mapped {
            return pieces::fill(values, |bytes, at| mapped.write(bytes, at));
        }
        pieces::fill(values, |bytes, at| self.memory.write(bytes, at))?;
        self.mapped = self.memory.map().ok();
        Ok(())
    }
}

impl Transfers {
    /// Puts a state by memory that was lent; `None` where it has to go in pieces.
    pub(super) fn put_in_memory(&self, head: PutHead, values: &[f64]) -> Option<Result<StateId, Status>> {
        let mut lent = self.borrow(head)?;
        if lent.fill(values).is_err() {
            self.give_back(lent.number);
            return None;
        }
        // Its name is made of what stands there, by the coordinator alone.
        let messages = [head.encode(), encode_in_memory(lent.number)];
        match taken(self.begin_put(tokio_stream::iter(messages))) {
            Ok(state) => {
                self.lock_lent().push(lent);
                Some(Ok(state))
            }
            Err(status) if status.code() == NOT_LENT => None,
            Err(status) => {
                self.give_back(lent.number);
                Some(Err(status))
            }
        }
    }

    /// Memory for a state: some that was lent before, or where the coordinator lends more.
    fn borrow(&self, head: PutHead) -> Option<LentMemory> {
        {
            let mut lent = self.lock_lent();
            // What is of another length is taken back.
            lent.retain(|lent| lent.n_state == head.n_state);
            if let Some(lent) = lent.pop() {
                return Some(lent);
            }
        }
        let asked = self.descriptors.as_ref()?.ask();
        let (number, n_state) = (asked.number(), head.n_state);
        let request = Lend { head, descriptor: number }.encode();
        let mut client = self.client.clone();
        let loan = self.begin(async move { client.lend(request).await }).blocking_recv().ok()?.ok()?;
        if !loan.get_ref().lent {
            return None;
        }
        let memory = asked.take().and_then(|came| SharedMemory::received(came, n_state * 8, false).ok());
        if memory.is_none() {
            self.give_back(number);
        }
        Some(LentMemory { number, n_state, memory: memory?, mapped: None })
    }

    /// Tells the coordinator that memory is of no use here; when this returns it knows, unless the session is over.
    fn give_back(&self, number: u64) {
        let request = GiveBack { epoch: self.epoch, nonce: self.nonce, descriptor: number }.encode();
        let mut client = self.client.clone();
        let told = self.begin(async move { client.give_back(request).await }).blocking_recv();
        tracing::debug!(number, ?told, "gave lent memory back");
    }

    fn lock_lent(&self) -> MutexGuard<'_, Vec<LentMemory>> {
        self.lent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
