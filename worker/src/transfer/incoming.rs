//! A state that has been asked for: it comes in pieces, as names of pieces in the shared folder, or as memory under a descriptor.
//!
//! Next file to read: [`super`].

use starlings_models::StateValues;
use starlings_pieces::SharedMemory;
use starlings_proto::convert::lent::decode_in_memory;
use starlings_proto::convert::piece_names::decode_names;
use starlings_proto::convert::state::{ChunkId, chunk_values, decode_chunk, n_chunks, name};
use starlings_proto::descriptors::Asked;
use starlings_proto::{StateId, StateNaming, digest, generated};
use tonic::Streaming;

use super::{Transfers, next, wrong};
use crate::pieces;

/// A state that has been asked for.
pub(crate) struct Incoming {
    pub(super) state: StateId,
    /// Number of its values.
    pub(crate) n_state: usize,
    pub(super) inbound: Streaming<generated::Chunk>,
    /// The descriptor of its memory, if it comes.
    pub(super) asked: Option<Asked>,
    pub(super) way: Transfers,
}

impl Incoming {
    /// Its values.
    pub(crate) async fn read(mut self) -> Result<StateValues, String> {
        let first = next(&mut self.inbound).await?;
        if decode_in_memory(&first).map_err(|error| wrong(&error))?.is_some() {
            return self.in_memory().await;
        }
        let Some(folder) = self.way.shared.clone().filter(|_| !first.names.is_empty()) else {
            return self.whole(Some(first)).await;
        };
        let names = self.names(&first).await?;
        let mut values = self.room()?;
        values.clear();
        let n_state = self.n_state;
        let read = tokio::task::spawn_blocking(move || pieces::read(&folder, &names, n_state, values));
        match read.await.map_err(|_| wrong(&"its thread ended"))? {
            Ok(values) => Ok(values.into()),
            // The coordinator finds out whether it can read what this worker cannot, or says which file is missing.
            Err(reason) => {
                self.way.refused(&reason);
                self.in_pieces().await
            }
        }
    }

    /// Asks for it again, to come piece by piece over the connection.
    async fn in_pieces(mut self) -> Result<StateValues, String> {
        (self.n_state, self.inbound) = self.way.open(self.state, false, 0).await?;
        self.whole(None).await
    }

    /// Its values, which stand in memory that the coordinator sees too.
    async fn in_memory(mut self) -> Result<StateValues, String> {
        let Some(asked) = self.asked.take() else {
            return Err(wrong(&"it is in memory whose descriptor was not asked for"));
        };
        let Some(descriptor) = asked.take() else {
            // It was lost on its way, as where this process has all descriptors that it may have.
            return self.in_pieces().await;
        };
        let n_state = self.n_state;
        let is_compared = self.way.compared.comes();
        let seen = tokio::task::spawn_blocking(move || {
            let memory = SharedMemory::received(descriptor, n_state * 8, true)?;
            let values = pieces::seen(&memory, n_state)?;
            Ok((is_compared.then(|| name(&values)), values))
        });
        let seen = seen.await.map_err(|_| wrong(&"its thread ended"))?;
        match seen.map_err(|error: std::io::Error| wrong(&error))? {
            (Some(name), _) if name != self.state => Err(wrong(&"its values are not those of its name")),
            (_, values) => Ok(values),
        }
    }

    /// The names of all its pieces, of which the first ones have come.
    async fn names(&mut self, first: &generated::Chunk) -> Result<Vec<ChunkId>, String> {
        let wanted = n_chunks(self.n_state);
        let of = |message: &generated::Chunk, had: usize| match decode_names(message, wanted - had) {
            Ok(Some(names)) => Ok(names),
            Ok(None) => Err(wrong(&"a piece came among names")),
            Err(error) => Err(wrong(&error)),
        };
        let mut names = of(first, 0)?;
        while names.len() < wanted {
            let message = next(&mut self.inbound).await?;
            names.extend(of(&message, names.len())?);
        }
        let mut naming = StateNaming::of(self.n_state);
        for name in &names {
            naming.piece(name);
        }
        if naming.finish() == self.state {
            Ok(names)
        } else {
            Err(wrong(&"its pieces are not those of its name"))
        }
    }

    /// Memory for its values, with whatever is in it.
    fn room(&self) -> Result<Vec<f64>, String> {
        let mut values = self.way.spare.take();
        let mb = self.n_state.saturating_mul(8) / 1_000_000;
        values
            .try_reserve_exact(self.n_state.saturating_sub(values.len()))
            .map_err(|_| format!("this machine has no memory for its state of {mb} MB"))?;
        Ok(values)
    }

    /// Its values, piece by piece over the connection.
    async fn whole(mut self, mut first: Option<generated::Chunk>) -> Result<StateValues, String> {
        let n_state = self.n_state;
        let mut values = self.room()?;
        values.clear();
        let mut naming = self.way.compared.comes().then(|| StateNaming::of(n_state));
        for index in 0..n_chunks(n_state) {
            let message = match first.take() {
                Some(message) => message,
                None => next(&mut self.inbound).await?,
            };
            let bytes = decode_chunk(message, chunk_values(n_state, index)).map_err(|error| wrong(&error))?;
            if let Some(naming) = &mut naming {
                naming.piece(&digest(&bytes));
            }
            values.extend(bytes.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)));
        }
        if naming.is_none_or(|naming| naming.finish() == self.state) {
            Ok(values.into())
        } else {
            Err(wrong(&"its values are not those of its name"))
        }
    }
}
