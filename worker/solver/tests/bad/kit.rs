//! A solver that answers as a test says, in this process or in one of its own.

#![allow(dead_code)] // the program of its own uses a part

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use starlings_models::{Job, ModelDef, SOLVER, Setup, SolverDef, Window};
use starlings_proto::convert::floats;
use starlings_proto::convert::solver::SOLVER_PROTOCOL;
use starlings_proto::generated_solver::run_reply::Kind;
use starlings_proto::generated_solver::solver_server::{Solver, SolverServer};
use starlings_proto::generated_solver::{
    DescribeRequest, Description, Finished, Quantity, RunReply, RunRequest,
};
use starlings_solver::{SiteOptions, Solvers};
use tokio::net::UnixListener;
use tokio::sync::mpsc;
use tokio_stream::wrappers::{ReceiverStream, UnixListenerStream};
use tonic::{Request, Response, Status};

/// What a solver does when it is asked for a run.
pub(crate) enum Reaction {
    /// It sends these messages and ends the stream.
    Says(Vec<RunReply>),
    /// It sends these messages, and ends the stream so much later.
    Lingers(Vec<RunReply>, Duration),
    /// It ends the stream with an error of the call.
    Refuses(Status),
    /// It never answers.
    Never,
    /// Its code panics, which resets the connection.
    Panics,
}

type React = Arc<dyn Fn(&RunRequest) -> Reaction + Send + Sync>;

/// A solver in a thread of this process.
pub(crate) struct Bad {
    folder: tempfile::TempDir,
    left: Arc<AtomicUsize>,
}

impl Bad {
    pub(crate) fn new(
        described: Description,
        react: impl Fn(&RunRequest) -> Reaction + Send + Sync + 'static,
    ) -> Self {
        Self::start(Service { react: Arc::new(react), ..Service::new(Some(described)) })
    }

    /// One that does not even say what it is.
    pub(crate) fn mute() -> Self {
        Self::start(Service::new(None))
    }

    fn start(service: Service) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("s");
        let left = Arc::clone(&service.left);
        std::thread::spawn(move || service.serve(&socket));
        Self { folder, left }
    }

    pub(crate) fn reached(&self) -> (Solvers, SolverDef) {
        (Solvers::new(SiteOptions::default()), reaching(&self.folder.path().join("s")))
    }

    /// Calls that were left before their end.
    pub(crate) fn left(&self) -> usize {
        self.left.load(Ordering::Relaxed)
    }
}

/// A solver that listens on this socket.
pub(crate) fn reaching(socket: &Path) -> SolverDef {
    SolverDef { address: Some(format!("unix:{}", socket.display())), ..SolverDef::default() }
}

/// The service; without a description it does not answer.
pub(crate) struct Service {
    pub(crate) described: Option<Description>,
    pub(crate) react: React,
    /// Calls that were left before their end.
    pub(crate) left: Arc<AtomicUsize>,
}

impl Service {
    /// One that never answers a run.
    pub(crate) fn new(described: Option<Description>) -> Self {
        Self { described, react: Arc::new(|_| Reaction::Never), left: Arc::default() }
    }

    /// Serves on this socket until the process ends.
    pub(crate) fn serve(self, socket: &Path) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let incoming = UnixListenerStream::new(UnixListener::bind(socket).unwrap());
            let server = tonic::transport::Server::builder().add_service(SolverServer::new(self));
            server.serve_with_incoming(incoming).await.unwrap();
        });
    }

    /// A stream of these messages that ends so much later.
    fn stream(
        &self,
        messages: impl IntoIterator<Item = Result<RunReply, Status>>,
        later: Duration,
    ) -> Response<ReceiverStream<Result<RunReply, Status>>> {
        let messages: Vec<_> = messages.into_iter().collect();
        let (sender, receiver) = mpsc::channel(messages.len().max(1));
        for message in messages {
            sender.try_send(message).unwrap();
        }
        let left = Arc::clone(&self.left);
        tokio::spawn(async move {
            tokio::time::sleep(later).await;
            left.fetch_add(usize::from(sender.is_closed()), Ordering::Relaxed);
        });
        Response::new(ReceiverStream::new(receiver))
    }
}

#[tonic::async_trait]
impl Solver for Service {
    async fn describe(&self, _: Request<DescribeRequest>) -> Result<Response<Description>, Status> {
        match &self.described {
            Some(described) => Ok(Response::new(described.clone())),
            None => std::future::pending().await,
        }
    }

    type RunStream = ReceiverStream<Result<RunReply, Status>>;

    async fn run(&self, request: Request<RunRequest>) -> Result<Response<Self::RunStream>, Status> {
        match (self.react)(request.get_ref()) {
            Reaction::Says(replies) => Ok(self.stream(replies.into_iter().map(Ok), Duration::ZERO)),
            Reaction::Lingers(replies, time) => Ok(self.stream(replies.into_iter().map(Ok), time)),
            Reaction::Refuses(status) => Ok(self.stream([Err(status)], Duration::ZERO)),
            Reaction::Never => std::future::pending().await,
            Reaction::Panics => panic!("a solver that panics"),
        }
    }
}

pub(crate) fn quantity(name: &str, unit: &str) -> Quantity {
    Quantity { name: name.to_owned(), unit: unit.to_owned(), ..Quantity::default() }
}

/// A description that makes sense: two of everything but inputs.
pub(crate) fn sound() -> Description {
    let two = |names: [&str; 2]| names.map(|name| quantity(name, "")).to_vec();
    Description {
        protocol: SOLVER_PROTOCOL,
        name: "beam".to_owned(),
        states: two(["x", "v"]),
        parameters: two(["k", "c"]),
        outputs: two(["tip", "slope"]),
        restart: true,
        deterministic: true,
        ..Description::default()
    }
}

pub(crate) fn finished(outputs: &[f64], state: &[f64]) -> RunReply {
    let finished = Finished { outputs: floats::encode(outputs), state: floats::encode(state) };
    RunReply { kind: Some(Kind::Finished(finished)) }
}

/// Zeros of the right number.
pub(crate) fn soundly(request: &RunRequest) -> Reaction {
    let n = request.observed.len() / size_of::<f64>();
    Reaction::Says(vec![finished(&vec![0.0; n], &[0.0; 2])])
}

/// The setup of a study of such a solver.
pub(crate) fn setup(solvers: &Solvers, def: &SolverDef) -> Setup {
    let described = Some(solvers.describe(def).unwrap());
    let solver = Some(Box::new(SolverDef { described, ..def.clone() }));
    Setup {
        model: ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() },
        parameters: ["k", "c"].map(str::to_owned).to_vec(),
        outputs: ["tip", "slope"].map(str::to_owned).to_vec(),
        ..Setup::default()
    }
}

/// A run over three times.
pub(crate) fn job(state: Option<Vec<f64>>) -> Job {
    let times = vec![0.1, 0.2, 0.3];
    let window = Window::free(0.0, times, 2, Vec::new());
    Job {
        particle: 3,
        record: 0,
        window: Arc::new(window),
        theta: vec![30.0, 0.5],
        state: state.map(Into::into),
    }
}
