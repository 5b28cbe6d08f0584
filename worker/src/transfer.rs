//! The way of large states between a worker and its coordinator: one stream each, beside the messages.
//!
//! Where both see one folder, the pieces stand there and only their names travel. Where both are processes of one machine, the state
//! stands in memory that both see, whose descriptor comes beside the messages. What arrives is checked by its name, piece by piece.
//! Next files to read: `incoming`, for what
//! comes; `lent`, for what goes by memory; `inbox`, for when states are asked for.

mod compared;
mod incoming;
mod lent;

use std::ops::Deref;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use starlings_models::ParticleError;
use starlings_pieces::Folder;
use starlings_proto::convert::state::{Get, PutHead, decode_head, decode_put_result};
use starlings_proto::descriptors::{Asked, DescriptorReceiver};
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::words::status_text;
use starlings_proto::{Lease, StateId};
use tokio::runtime::Handle;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::{Response, Status, Streaming};

pub(crate) use incoming::Incoming;

use crate::pieces::{self, Sent};
use crate::spare::Spare;
use crate::way::Proven;
pub(crate) use compared::Compared;
use lent::LentMemory;

/// States that are sent at the same time: what they leave of the connection's window is for the messages.
const LANES: usize = 2;

/// Pieces made ahead of what the network has taken.
const AHEAD: usize = 4;

/// What the coordinator answers to a put.
type PutAnswer = oneshot::Receiver<Result<Response<generated::PutResult>, Status>>;

/// The way of states over one session. Every job of it holds one, small state or large: a clone costs a count.
#[derive(Clone)]
pub(crate) struct Transfers(Arc<Session>);

/// What all clones share.
pub(crate) struct Session {
    client: FleetClient<Proven>,
    runtime: Handle,
    lanes: Arc<Semaphore>,
    ended: CancellationToken,
    spare: Spare,
    epoch: u64,
    nonce: u64,
    shared: Option<Arc<Folder>>,
    descriptors: Option<Arc<DescriptorReceiver>>,
    /// Memory that the coordinator lent and nobody writes now.
    lent: Mutex<Vec<LentMemory>>,
    compared: Compared,
    /// Whether it was told that the folder refuses.
    is_told: AtomicBool,
}

impl Deref for Transfers {
    type Target = Session;

    fn deref(&self) -> &Session {
        &self.0
    }
}

impl Transfers {
    /// The way over a connection whose worker is taken, of this session (epoch and nonce); called where the network lives.
    pub(crate) fn new(
        client: FleetClient<Proven>,
        (epoch, nonce): (u64, u64),
        shared: Option<Arc<Folder>>,
        (descriptors, compared): (Option<Arc<DescriptorReceiver>>, Compared),
    ) -> Self {
        Self(Arc::new(Session {
            client,
            runtime: Handle::current(),
            lanes: Arc::new(Semaphore::new(LANES)),
            ended: CancellationToken::new(),
            spare: Spare::default(),
            epoch,
            nonce,
            shared,
            descriptors,
            lent: Mutex::default(),
            compared,
            is_told: AtomicBool::new(false),
        }))
    }

    /// Says once in a session that what should go through the folder goes over the connection.
    fn refused(&self, reason: &str) {
        if self.is_told.swap(true, Ordering::Relaxed) {
            tracing::debug!(reason, "a state goes over the connection");
        } else {
            tracing::warn!("states go over the connection where the shared folder refuses: {reason}");
        }
    }

    /// The folder of states that the coordinator sees too.
    pub(crate) fn shared(&self) -> Option<Arc<Folder>> {
        self.shared.clone()
    }

    /// The session is over: nothing that is on its way is waited for.
    pub(crate) fn end(&self) {
        self.ended.cancel();
    }

    /// A way on which nothing travels.
    #[cfg(test)]
    pub(crate) fn nowhere(runtime: &Handle) -> Self {
        let _inside = runtime.enter();
        Self::new(FleetClient::new(crate::way::nowhere()), (1, 1), None, (None, Compared::new(false)))
    }

    /// Asks for a state; its values come when they are read.
    pub(crate) async fn ask(&self, state: StateId) -> Result<Incoming, String> {
        let asked = self.descriptors.as_ref().map(DescriptorReceiver::ask);
        let number = asked.as_ref().map_or(0, Asked::number);
        let (n_state, inbound) = self.open(state, self.shared.is_some(), number).await?;
        Ok(Incoming { state, n_state, inbound, asked, way: self.clone() })
    }

    /// The number of values of a state, and the way on which they come, or the names of its pieces.
    async fn open(
        &self,
        state: StateId,
        names: bool,
        descriptor: u64,
    ) -> Result<(usize, Streaming<generated::Chunk>), String> {
        let request = Get { epoch: self.epoch, nonce: self.nonce, state, names, descriptor }.encode();
        let mut inbound = self.client.clone().get(request).await.map_err(|s| lost(&s))?.into_inner();
        let head = next(&mut inbound).await?;
        Ok((decode_head(&head).map_err(|error| wrong(&error))?, inbound))
    }

    /// Takes the memory of a state that is no longer needed, for one that comes.
    pub(crate) fn recycle(&self, values: Vec<f64>) {
        self.spare.give(values);
    }

    /// Sends a state; it has arrived at the coordinator by then. For a thread that may wait.
    pub(crate) fn put(&self, lease: Lease, values: &[f64]) -> Result<StateId, ParticleError> {
        let head = PutHead { n_state: values.len(), lease, nonce: self.nonce };
        if let Some(folder) = &self.shared {
            let named = pieces::write(folder, values)
                .and_then(|names| self.send(|pieces| pieces::send_names(&pieces, head, &names)));
            match named {
                Ok(state) => return Ok(state),
                Err(reason) => self.refused(&reason),
            }
        }
        let by_memory = self.put_in_memory(head, values);
        if let Some(taken) = by_memory {
            return taken.map_err(|status| not_taken(&status_text(&status)));
        }
        let is_compared = self.compared.goes();
        let sent = self.send(|pieces| pieces::send(&pieces, head, values, is_compared));
        sent.map_err(|reason| not_taken(&reason))
    }

    /// Puts what `send` says, which returns the name that the coordinator must answer with, if it is to be compared.
    fn send(&self, send: impl FnOnce(mpsc::Sender<generated::Chunk>) -> Sent) -> Result<StateId, String> {
        let (pieces, outgoing) = mpsc::channel(AHEAD);
        let answered = self.begin_put(ReceiverStream::new(outgoing));
        let sent = send(pieces);
        let taken = taken(answered).map_err(|status| status_text(&status))?;
        match sent {
            Sent::Unnamed => Ok(taken),
            Sent::Named(name) if name == taken => Ok(taken),
            Sent::Named(_) | Sent::Ended => Err("another one arrived than was sent".to_owned()),
        }
    }

    /// Begins to put a state that these messages bring.
    fn begin_put(&self, messages: impl Stream<Item = generated::Chunk> + Send + 'static) -> PutAnswer {
        let (mut client, lanes) = (self.client.clone(), Arc::clone(&self.lanes));
        self.begin(async move {
            // It is never closed.
            let _lane = lanes.acquire().await;
            client.put(messages).await
        })
    }

    /// Begins a call; its answer does not come where the session ends before.
    fn begin<T: Send + 'static>(
        &self,
        call: impl Future<Output = T> + Send + 'static,
    ) -> oneshot::Receiver<T> {
        let (answer, answered) = oneshot::channel();
        let ended = self.ended.clone();
        self.runtime.spawn(async move {
            if let Some(result) = ended.run_until_cancelled(call).await {
                let _ = answer.send(result);
            }
        });
        answered
    }
}

/// The name of a state that was put, once it has arrived. For a thread that may wait.
fn taken(answered: PutAnswer) -> Result<StateId, Status> {
    let result = answered.blocking_recv().map_err(|_| Status::unavailable("the connection is gone"))??;
    decode_put_result(result.get_ref()).map_err(|error| Status::internal(error.to_string()))
}

async fn next(inbound: &mut Streaming<generated::Chunk>) -> Result<generated::Chunk, String> {
    inbound.message().await.map_err(|status| lost(&status))?.ok_or_else(|| wrong(&"it ended early"))
}

fn not_taken(reason: &str) -> ParticleError {
    ParticleError::Infrastructure(format!("its end state was not taken: {reason}"))
}

fn lost(status: &Status) -> String {
    format!("its state did not arrive: {}", status_text(status))
}

fn wrong(error: &dyn std::fmt::Display) -> String {
    format!("its state did not arrive whole: {error}")
}
