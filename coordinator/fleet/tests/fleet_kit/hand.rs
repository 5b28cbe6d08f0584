//! A worker played by hand: says what it is told to say.

use std::net::SocketAddr;

use starlings_models::{Prediction, StateValues};
use starlings_proto::generated::{self, fleet_client::FleetClient};
use starlings_proto::{
    FromWorker, Hello, Lease, LeaseOutcome, PROTOCOL, ReceivedWindows, State, ToWorker, VERSION,
};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio_stream::wrappers::UnboundedReceiverStream;
use tonic::Streaming;
use tonic::transport::Channel;

use super::square;

/// A worker played by hand.
pub struct Hand {
    pub client: FleetClient<Channel>,
    pub outbox: UnboundedSender<generated::FromWorker>,
    pub inbound: Streaming<generated::ToWorker>,
    windows: ReceivedWindows,
}

impl Hand {
    pub async fn dial(address: SocketAddr, hello: Hello) -> Self {
        Self::over(FleetClient::connect(format!("http://{address}")).await.unwrap(), hello).await
    }

    /// One over a connection that is there.
    pub async fn over(mut client: FleetClient<Channel>, hello: Hello) -> Self {
        let (outbox, outgoing) = unbounded_channel();
        outbox.send(FromWorker::Hello(hello).encode().unwrap()).unwrap();
        let inbound = client.work(UnboundedReceiverStream::new(outgoing)).await.unwrap().into_inner();
        Self { client, outbox, inbound, windows: ReceivedWindows::default() }
    }

    pub fn say(&self, message: FromWorker) {
        self.outbox.send(message.encode().unwrap()).unwrap();
    }

    /// The next message that is no heartbeat; `None` when the stream ended.
    pub async fn hear(&mut self) -> Option<ToWorker> {
        while let Ok(Some(message)) = self.inbound.message().await {
            match ToWorker::decode(message, &mut self.windows).unwrap() {
                ToWorker::Heartbeat => {}
                message => return Some(message),
            }
        }
        None
    }

    /// Builds the setup and returns the first jobs, as many as asked for.
    pub async fn take_jobs(&mut self, n: usize) -> Vec<(Lease, starlings_models::Job)> {
        let mut jobs = vec![];
        while jobs.len() < n {
            match self.hear().await.expect("still connected") {
                ToWorker::Setup { id, .. } => self.say(FromWorker::Setup { id, result: Ok(()) }),
                ToWorker::Job { lease, job, .. } => jobs.push((lease, job.try_map(inside).unwrap())),
                _ => {}
            }
        }
        jobs
    }

    /// Until the run is over; a stream dropped earlier would take unsent answers with it.
    pub async fn stay_until_drained(&mut self) {
        while !matches!(self.hear().await, Some(ToWorker::Drain(_)) | None) {}
    }

    pub fn answer(&self, lease: Lease, job: &starlings_models::Job) {
        self.say(FromWorker::Result { lease, answer: LeaseOutcome::Ran(Ok(squared(job))), cost: 1.0 });
    }
}

/// The exact answer to a job, as it travels.
pub fn squared(job: &starlings_models::Job) -> Prediction<State> {
    square(job).try_map(|values| Ok::<_, ()>(State::from(values.into_vec()))).unwrap()
}

/// A state that came inside its job.
pub fn inside(state: State) -> Result<StateValues, State> {
    if let State::Values(values) = state { Ok(values.into()) } else { Err(state) }
}

pub fn hello() -> Hello {
    Hello {
        protocol: PROTOCOL,
        version: VERSION.to_owned(),
        cores: 1,
        slots: 1,
        host: "hand".to_owned(),
        pid: 1,
        nonce: 42,
        build: None,
    }
}

pub fn block_on<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(future)
}
