//! The way of large states between a worker and its coordinator: one stream each, beside the messages.
//!
//! What arrives is checked by its name, piece by piece. Next file to read: `inbox`, for when states are asked for.

use std::sync::Arc;

use starlings_models::ParticleError;
use starlings_proto::convert::floats;
use starlings_proto::convert::state::{
    CHUNK_VALUES, Get, PutHead, chunk_values, decode_chunk, decode_head, decode_put_result, encode_chunk,
    n_chunks,
};
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::words::status_text;
use starlings_proto::{Lease, StateId, StateNaming, digest};
use tokio::runtime::Handle;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::{Status, Streaming};

use crate::spare::Spare;
use crate::way::Proven;

/// States that are sent at the same time: what they leave of the connection's window is for the messages.
const LANES: usize = 2;

/// Pieces made ahead of what the network has taken.
const AHEAD: usize = 4;

/// The way of states over one session.
#[derive(Clone)]
pub(crate) struct Transfers {
    client: FleetClient<Proven>,
    runtime: Handle,
    lanes: Arc<Semaphore>,
    ended: CancellationToken,
    spare: Spare,
    epoch: u64,
    nonce: u64,
}

impl Transfers {
    /// The way over a connection whose worker is taken; called where the network lives.
    pub(crate) fn new(client: FleetClient<Proven>, epoch: u64, nonce: u64) -> Self {
        Self {
            client,
            runtime: Handle::current(),
            lanes: Arc::new(Semaphore::new(LANES)),
            ended: CancellationToken::new(),
            spare: Spare::default(),
            epoch,
            nonce,
        }
    }

    /// The session is over: nothing that is on its way is waited for.
    pub(crate) fn end(&self) {
        self.ended.cancel();
    }

    /// A way on which nothing travels.
    #[cfg(test)]
    pub(crate) fn nowhere(runtime: &Handle) -> Self {
        let _inside = runtime.enter();
        Self::new(FleetClient::new(crate::way::nowhere()), 1, 1)
    }

    /// Asks for a state; its values come when they are read.
    pub(crate) async fn ask(&self, state: StateId) -> Result<Incoming, String> {
        let request = Get { epoch: self.epoch, nonce: self.nonce, state }.encode();
        let mut inbound = self.client.clone().get(request).await.map_err(|s| lost(&s))?.into_inner();
        let head = next(&mut inbound).await?;
        let n_state = decode_head(&head).map_err(|error| wrong(&error))?;
        Ok(Incoming { state, n_state, inbound, spare: self.spare.clone() })
    }

    /// Takes the memory of a state that is no longer needed, for one that comes.
    pub(crate) fn recycle(&self, values: Vec<f64>) {
        self.spare.give(values);
    }

    /// Sends a state; it has arrived at the coordinator by then. For a thread that may wait.
    pub(crate) fn put(&self, lease: Lease, values: &[f64]) -> Result<StateId, ParticleError> {
        let (pieces, outgoing) = mpsc::channel(AHEAD);
        let (answer, answered) = oneshot::channel();
        let (mut client, lanes, ended) = (self.client.clone(), Arc::clone(&self.lanes), self.ended.clone());
        self.runtime.spawn(async move {
            let sent = async {
                // It is never closed.
                let _lane = lanes.acquire().await;
                client.put(ReceiverStream::new(outgoing)).await
            };
            if let Some(result) = ended.run_until_cancelled(sent).await {
                let _ = answer.send(result);
            }
        });
        let name = send(pieces, PutHead { n_state: values.len(), lease, nonce: self.nonce }, values);
        let refused =
            |text: String| ParticleError::Infrastructure(format!("its end state was not taken: {text}"));
        let lost = || refused("the connection is gone".to_owned());
        let result = answered.blocking_recv().map_err(|_| lost())?;
        let result = result.map_err(|status| refused(status_text(&status)))?;
        let taken = decode_put_result(result.get_ref()).map_err(|error| refused(error.to_string()))?;
        if Some(taken) == name {
            Ok(taken)
        } else {
            Err(refused("another one arrived than was sent".to_owned()))
        }
    }
}

/// A state that has been asked for.
pub(crate) struct Incoming {
    state: StateId,
    /// Number of its values.
    pub(crate) n_state: usize,
    inbound: Streaming<generated::Chunk>,
    spare: Spare,
}

impl Incoming {
    /// Its values.
    pub(crate) async fn read(mut self) -> Result<Vec<f64>, String> {
        let n_state = self.n_state;
        let mut values = self.spare.take();
        values.try_reserve_exact(n_state).map_err(|_| {
            format!(
                "this machine has no memory for its state of {} MB",
                n_state.saturating_mul(8) / 1_000_000
            )
        })?;
        let mut naming = StateNaming::of(n_state);
        for index in 0..n_chunks(n_state) {
            let message = next(&mut self.inbound).await?;
            let bytes = decode_chunk(message, chunk_values(n_state, index)).map_err(|error| wrong(&error))?;
            naming.piece(&digest(&bytes));
            values.extend(bytes.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)));
        }
        if naming.finish() == self.state {
            Ok(values)
        } else {
            Err(wrong(&"its values are not those of its name"))
        }
    }
}

async fn next(inbound: &mut Streaming<generated::Chunk>) -> Result<generated::Chunk, String> {
    inbound.message().await.map_err(|status| lost(&status))?.ok_or_else(|| wrong(&"it ended early"))
}

fn lost(status: &Status) -> String {
    format!("its state did not arrive: {}", status_text(status))
}

fn wrong(error: &dyn std::fmt::Display) -> String {
    format!("its state did not arrive whole: {error}")
}

/// Sends a state piece by piece; its name, unless the stream ended before it.
#[expect(clippy::needless_pass_by_value, reason = "the stream ends with it")]
fn send(pieces: mpsc::Sender<generated::Chunk>, head: PutHead, values: &[f64]) -> Option<StateId> {
    let mut naming = StateNaming::of(values.len());
    pieces.blocking_send(head.encode()).ok()?;
    for piece in values.chunks(CHUNK_VALUES) {
        let bytes = floats::encode(piece);
        naming.piece(&digest(&bytes));
        pieces.blocking_send(encode_chunk(bytes)).ok()?;
    }
    Some(naming.finish())
}
