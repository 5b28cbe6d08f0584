//! Large states on their way between workers and the store: one stream each, beside the workers' own.
//!
//! Everything that arrives is checked before it is kept: that the worker has a session and the run a lease, lengths, values, and by
//! the name that all of it came as it went. A worker of this machine that takes descriptors reads states where they are, and writes them
//! into memory that it is lent. Next file to read: `hub/states.rs`.

use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::Duration;

use starlings_proto::convert::lent::{GiveBack, Lend, NOT_LENT, decode_in_memory, encode_in_memory};
use starlings_proto::convert::piece_names::{NAMES, decode_names, encode_names};
use starlings_proto::convert::state::{
    CHUNK_BYTES, ChunkId, Get, PutHead, decode_chunk, encode_chunk, encode_head, encode_put_result,
};
use starlings_proto::descriptors::DescriptorSender;
use starlings_proto::generated;
use starlings_states::{Lent, StateError, StateWriter, StoredState, not_finite};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, Streaming};

use super::hub::Hub;

/// Pieces that are read ahead of what the network has taken.
const AHEAD: usize = 2;

/// How long a worker may leave a put without its next piece.
const PATIENCE: Duration = Duration::from_secs(60);

/// Takes a state into the store.
pub(super) async fn put(
    hub: &Arc<Hub>,
    mut inbound: Streaming<generated::Chunk>,
) -> Result<generated::PutResult, Status> {
    let invalid = |error: &dyn std::fmt::Display| Status::invalid_argument(error.to_string());
    let first = next(&mut inbound).await?.ok_or_else(|| Status::invalid_argument("a put without a head"))?;
    let head = PutHead::decode(&first).map_err(|error| invalid(&error))?;
    let mut counted = hub.begin_put(&head)?;
    let mut writer = hub.states().writer(head.n_state);
    while let Some(message) = next(&mut inbound).await? {
        if let Some(number) = decode_in_memory(&message).map_err(|error| invalid(&error))? {
            counted.came(8 * head.n_state);
            return written(hub, &head, number).await;
        }
        if let Some(names) = decode_names(&message, writer.missing()).map_err(|error| invalid(&error))? {
            writer = find(hub, writer, names).await?;
            continue;
        }
        let bytes = decode_chunk(message, writer.wanted()).map_err(|error| invalid(&error))?;
        if let Some(value) = not_finite(&bytes) {
            return Err(invalid(&StateError::NotFinite { value }));
        }
        counted.came(bytes.len());
        writer = keep(hub, writer, bytes).await?;
    }
    let state = writer.finish().map_err(|error| invalid(&error))?;
    let result = encode_put_result(&state.id());
    hub.end_put(&head, state)?;
    Ok(result)
}

/// Takes a state that its worker wrote into memory that it was lent under a number.
async fn written(hub: &Arc<Hub>, head: &PutHead, number: u64) -> Result<generated::PutResult, Status> {
    let lent = hub.lent(head, number).filter(|lent| lent.n_state() == head.n_state);
    let lent = lent.ok_or_else(|| Status::new(NOT_LENT, "no memory is lent for this state"))?;
    let writer = hub.states().writer(head.n_state);
    let state = on_disk(move || lent.copy(writer)).await?.map_err(|error| match error {
        StateError::NotFinite { .. } => Status::invalid_argument(error.to_string()),
        _ => lost(hub, &error),
    })?;
    let result = encode_put_result(&state.id());
    hub.end_put(head, state)?;
    Ok(result)
}

/// Lends memory for end states to a worker that takes descriptors, where there is room.
pub(super) fn lend(
    hub: &Arc<Hub>,
    request: &generated::LendRequest,
    way: Option<&DescriptorSender>,
) -> Result<generated::Loan, Status> {
    let lend = Lend::decode(request).map_err(|error| Status::invalid_argument(error.to_string()))?;
    let give = |lent: &Lent| way.is_some_and(|way| way.send(lend.descriptor, lent.as_fd()).is_ok());
    let lent = hub.lend(&lend, give)?;
    Ok(generated::Loan { lent })
}

/// Takes memory back that its worker cannot use.
pub(super) fn give_back(
    hub: &Arc<Hub>,
    request: &generated::GiveBackRequest,
) -> Result<generated::GivenBack, Status> {
    let back = GiveBack::decode(request).map_err(|error| Status::invalid_argument(error.to_string()))?;
    hub.give_back(&back)?;
    Ok(generated::GivenBack {})
}

async fn next(inbound: &mut Streaming<generated::Chunk>) -> Result<Option<generated::Chunk>, Status> {
    let message = tokio::time::timeout(PATIENCE, inbound.message()).await;
    message.map_err(|_| Status::deadline_exceeded("the next piece of the state did not come"))?
}

/// Keeps a piece: on this thread where it goes into memory, else on one that may wait for the disk.
async fn keep(hub: &Arc<Hub>, mut writer: StateWriter, bytes: bytes::Bytes) -> Result<StateWriter, Status> {
    // A short one would keep the buffer that it came in.
    let bytes = if bytes.len() < CHUNK_BYTES { bytes::Bytes::copy_from_slice(&bytes) } else { bytes };
    let pushed = if hub.states().has_room(bytes.len()) {
        writer.push(bytes).map(|()| writer)
    } else {
        on_disk(move || writer.push(bytes).map(|()| writer)).await?
    };
    pushed.map_err(|error| lost(hub, &error))
}

/// Takes pieces that stand in the shared folder. One that does not is no fault of this side: the worker sends its state instead.
async fn find(hub: &Arc<Hub>, mut writer: StateWriter, names: Vec<ChunkId>) -> Result<StateWriter, Status> {
    if !hub.states().is_shared() {
        return Err(Status::failed_precondition("no folder for states is shared"));
    }
    let found = on_disk(move || {
        let found = names.into_iter().try_for_each(|name| writer.push_existing(name));
        found.map(|()| writer)
    });
    found.await?.map_err(|error| Status::failed_precondition(error.to_string()))
}

/// Gives a state to a worker: its memory where the worker takes descriptors, the names of its pieces where it shares the folder.
pub(super) fn get(
    hub: &Arc<Hub>,
    request: &generated::GetRequest,
    way: Option<&DescriptorSender>,
) -> Result<ReceiverStream<Result<generated::Chunk, Status>>, Status> {
    let get = Get::decode(request).map_err(|error| Status::invalid_argument(error.to_string()))?;
    let (state, mut counted) = hub.begin_get(&get)?;
    let (sender, pieces) = mpsc::channel(AHEAD);
    let by_names = get.names && hub.states().is_shared();
    let in_memory = get.descriptor != 0
        && state.descriptor().zip(way).is_some_and(|(memory, way)| way.send(get.descriptor, memory).is_ok());
    if in_memory {
        counted.went(8 * state.n_state());
        // There is room for both, so that they go in one.
        for message in [encode_head(state.n_state()), encode_in_memory(get.descriptor)] {
            let _ = sender.try_send(Ok(message));
        }
        return Ok(ReceiverStream::new(pieces));
    }
    let hub = Arc::clone(hub);
    tokio::spawn(async move {
        let mut given = sender.send(Ok(encode_head(state.n_state()))).await.is_ok();
        if by_names {
            for names in state.pieces().chunks(NAMES) {
                if sender.send(Ok(encode_names(names))).await.is_err() {
                    return;
                }
            }
            return;
        }
        for index in 0..state.pieces().len() {
            // Nobody reads what comes.
            if !given {
                return;
            }
            let piece = piece(&hub, &state, index).await;
            counted.went(piece.as_ref().map_or(0, bytes::Bytes::len));
            let message = piece.map(encode_chunk);
            let ended = message.is_err();
            given = sender.send(message).await.is_ok() && !ended;
        }
    });
    Ok(ReceiverStream::new(pieces))
}

async fn piece(hub: &Arc<Hub>, state: &StoredState, index: usize) -> Result<bytes::Bytes, Status> {
    let read = if state.is_in_memory(index) {
        state.piece(index)
    } else {
        let state = state.clone();
        on_disk(move || state.piece(index)).await?
    };
    read.map_err(|error| lost(hub, &error))
}

async fn on_disk<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Status> {
    tokio::task::spawn_blocking(work).await.map_err(|_| Status::internal("a thread of the coordinator ended"))
}

/// A state that this side cannot keep or read is no worker's fault: the batch ends with the reason.
fn lost(hub: &Arc<Hub>, error: &StateError) -> Status {
    hub.state_lost(error.to_string());
    Status::unavailable(error.to_string())
}
