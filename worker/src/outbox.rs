//! The way of a worker's messages to its coordinator.

use starlings_proto::{FromWorker, generated};
use tokio::sync::mpsc::UnboundedSender;

/// Sends a message; one of a stream that has ended is nobody's.
pub(crate) fn send(outbox: &UnboundedSender<generated::FromWorker>, message: FromWorker) {
    if let Ok(message) = message.encode() {
        let _ = outbox.send(message);
    }
}
