//! The gRPC side of a worker's connection: reads its stream and turns each message into an event.

use std::sync::Arc;
use std::time::Duration;

use starlings_proto::descriptors::DescriptorSender;
use starlings_proto::generated::{self, fleet_server};
use starlings_proto::words::status_text;
use starlings_proto::{FromWorker, ToWorker};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};

use super::dispatcher::{Event, WorkerId};
use super::hub::{Closed, Hub};
use super::outbox::{GivenUp, Unread, outbox};
use super::transfer;

/// How long a connection may stay open without a Hello.
const HELLO_PATIENCE: Duration = Duration::from_secs(10);

pub(super) struct Service {
    pub(super) hub: Arc<Hub>,
}

#[tonic::async_trait]
impl fleet_server::Fleet for Service {
    type WorkStream = Unread;
    type GetStream = ReceiverStream<Result<generated::Chunk, Status>>;

    async fn put(
        &self,
        request: Request<Streaming<generated::Chunk>>,
    ) -> Result<Response<generated::PutResult>, Status> {
        transfer::put(&self.hub, request.into_inner()).await.map(Response::new)
    }

    async fn get(
        &self,
        request: Request<generated::GetRequest>,
    ) -> Result<Response<Self::GetStream>, Status> {
        transfer::get(&self.hub, request.get_ref(), way(&request)).map(Response::new)
    }

    async fn lend(
        &self,
        request: Request<generated::LendRequest>,
    ) -> Result<Response<generated::Loan>, Status> {
        transfer::lend(&self.hub, request.get_ref(), way(&request)).map(Response::new)
    }

    async fn give_back(
        &self,
        request: Request<generated::GiveBackRequest>,
    ) -> Result<Response<generated::GivenBack>, Status> {
        transfer::give_back(&self.hub, request.get_ref()).map(Response::new)
    }

    async fn work(
        &self,
        request: Request<Streaming<generated::FromWorker>>,
    ) -> Result<Response<Self::WorkStream>, Status> {
        let mut inbound = request.into_inner();
        let first = tokio::time::timeout(HELLO_PATIENCE, inbound.message())
            .await
            .map_err(|_| Status::deadline_exceeded("no Hello arrived"))??
            .ok_or_else(|| Status::invalid_argument("the stream ended before a Hello"))?;
        let hello = match FromWorker::decode(first) {
            Ok(FromWorker::Hello(hello)) => hello,
            Ok(_) => return Err(Status::invalid_argument("the first message must be a Hello")),
            Err(error) => return Err(Status::invalid_argument(error.to_string())),
        };
        let (link, outgoing) = outbox();
        match self.hub.join(hello, link.clone()) {
            Ok(worker) => {
                tokio::spawn(read(Arc::clone(&self.hub), worker, inbound, link.given_up()));
            }
            Err(Closed::Refused(reason)) => {
                link.send(ToWorker::refuse(&reason));
            }
            Err(Closed::Over(reason)) => {
                link.send(ToWorker::drain(&reason));
            }
        }
        Ok(Response::new(outgoing))
    }
}

/// The way of descriptors beside the connection on which a request came.
fn way<T>(request: &Request<T>) -> Option<&DescriptorSender> {
    request.extensions().get::<Option<DescriptorSender>>()?.as_ref()
}

/// Tells the hub that a worker left, however its reader ended.
struct Leaving {
    hub: Arc<Hub>,
    worker: WorkerId,
    reason: String,
    clean: bool,
}

impl Drop for Leaving {
    fn drop(&mut self) {
        self.hub.leave(self.worker, std::mem::take(&mut self.reason), self.clean);
    }
}

/// Reads until the stream ends or the worker is given up; it leaves with it.
async fn read(
    hub: Arc<Hub>,
    worker: WorkerId,
    mut inbound: Streaming<generated::FromWorker>,
    given_up: GivenUp,
) {
    let mut given_up = std::pin::pin!(given_up.reason());
    let reason = "its messages are no longer read".to_owned();
    let mut leaving = Leaving { hub: Arc::clone(&hub), worker, reason, clean: false };
    (leaving.reason, leaving.clean) = loop {
        let message = tokio::select! {
            biased;
            reason = &mut given_up => break (reason, false),
            message = inbound.message() => message,
        };
        match message {
            Ok(Some(message)) => match FromWorker::decode(message) {
                Ok(FromWorker::Goodbye(reason)) => break (reason, true),
                Ok(message) => {
                    if let FromWorker::Held(runs) = message {
                        hub.bring(worker, runs);
                    } else if let FromWorker::SharesStates = message {
                        hub.shares_states(worker);
                    } else if let FromWorker::Recombined { lease, made } = message {
                        hub.recombined(worker, lease, made);
                    } else if let Some(event) = event(worker, message) {
                        hub.handle(event);
                    }
                }
                Err(error) => break (format!("it sent a malformed message: {error}"), false),
            },
            Ok(None) => break ("it closed the connection".to_owned(), false),
            Err(status) => break (format!("the connection broke: {}", status_text(&status)), false),
        }
    };
}

fn event(worker: WorkerId, message: FromWorker) -> Option<Event> {
    Some(match message {
        FromWorker::Setup { id: setup, result: Ok(()) } => Event::SetupDone { worker, setup },
        FromWorker::Setup { id: setup, result: Err(reason) } => Event::SetupFailed { worker, setup, reason },
        FromWorker::Result { lease, answer, cost } => Event::Answered { worker, lease, answer, cost },
        FromWorker::Heartbeat { .. } => Event::Heard { worker },
        FromWorker::Hello(_)
        | FromWorker::Goodbye(_)
        | FromWorker::Held(_)
        | FromWorker::SharesStates
        | FromWorker::Recombined { .. } => return None,
    })
}
