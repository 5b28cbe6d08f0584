//! Serves a built-in model as an external solver: the other end of `solver.proto`.
//!
//! What a solver in another language does, done for a model of a study: for trying out the protocol, for conformance, and to put
//! a model of equations behind a process of its own. Next file to read: `proto/solver.proto`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use starlings_models::{
    Addition, BuildSetup, Description, EffectDef, EffectParameter, Job, ModelDef, ModelFailure,
    ParticleError, Quantity, SOLVER, Setup, SetupError, Solved, Spec,
};
use starlings_proto::FRAME_SIZE;
use starlings_proto::convert::solver::description::encode_description;
use starlings_proto::convert::solver::{Reply, Request, decode_run, encode_reply};
use starlings_proto::generated_solver::solver_server::{Solver, SolverServer};
use starlings_proto::generated_solver::{self as generated, RunReply, RunRequest};
use starlings_proto::words::panic_text;
use tokio::net::UnixListener;
use tokio_stream::wrappers::UnixListenerStream;
use tonic::{Response, Status};

/// HTTP/2 windows, bytes: a state of many megabytes travels in one go.
const WINDOW: u32 = 64 * 1024 * 1024;

/// A built-in model as a solver.
pub struct Served {
    model: ModelDef,
    spec: Spec,
}

impl Served {
    /// Serves this model, without effects.
    ///
    /// # Errors
    /// When the model does not build.
    pub fn new(model: ModelDef) -> Result<Self, SetupError> {
        let spec = Setup { model: model.clone(), ..Setup::default() }.spec()?;
        Ok(Self { model, spec })
    }

    /// What it says of itself.
    pub fn description(&self) -> Description {
        let scalar = self.spec.states.iter().filter(|q| q.size == 1 && !q.name.contains(':'));
        Description {
            name: self.spec.kind.clone(),
            deterministic: true,
            observers: Vec::new(),
            hosts: scalar.map(|q| q.name.clone()).collect(),
            spec: Spec {
                kind: SOLVER.to_owned(),
                states: self.spec.states.iter().map(plain).collect(),
                ..self.spec.clone()
            },
        }
    }

    fn run(&self, request: Request) -> Result<Solved, ParticleError> {
        let bad = |error: SetupError| ParticleError::BadJob(error.to_string());
        let names = self.spec.parameters.iter().map(|q| q.name.clone());
        let initial = request.initial.iter().map(|(name, _)| format!("initial:{name}"));
        let mut model = self.model.clone();
        model.constants.retain(|name, _| self.spec.parameters.iter().all(|q| q.name != *name));
        model.constants.extend(request.constants);
        model.constants.extend((0..request.terms.len()).map(|i| (amplitude(i), 1.0)));
        let effects = request.terms.into_iter().enumerate().map(|(i, add)| hosted(i, add)).collect();
        let setup = Setup {
            model,
            parameters: names.chain(initial).collect(),
            outputs: request.outputs,
            observer: request.observer,
            effects,
            max_steps: None,
            timeout: None,
            noise: None,
            sums: None,
            periods: Vec::new(),
            slopes: false,
        };
        let theta =
            request.parameters.into_iter().chain(request.initial.iter().map(|(_, value)| *value)).collect();
        let forward = setup.build().map_err(bad)?;
        let job = Job {
            particle: request.particle,
            record: request.record,
            window: Arc::new(request.window),
            theta,
            state: request.state.map(Into::into),
        };
        let prediction = forward.run(&job)?;
        Ok(Solved { outputs: prediction.outputs, state: prediction.state.into_vec() })
    }
}

/// A state under a name that the protocol takes.
fn plain(q: &Quantity) -> Quantity {
    Quantity { name: q.name.replace(':', "_"), ..q.clone() }
}

/// Name of the amplitude of the `i`th hosted term.
fn amplitude(i: usize) -> String {
    format!("hosted_term_{i}")
}

/// A term as an effect; its amplitude is one.
fn hosted(i: usize, add: Addition) -> EffectDef {
    let parameter = EffectParameter { name: amplitude(i), ..EffectParameter::default() };
    let term = format!("{}*({})", amplitude(i), add.term);
    EffectDef {
        name: format!("hosted term {i}"),
        adds: vec![Addition { term, ..add }],
        parameters: vec![parameter],
        ..EffectDef::default()
    }
}

/// The service of a model.
struct Service(Arc<Served>);

#[tonic::async_trait]
impl Solver for Service {
    async fn describe(
        &self,
        _request: tonic::Request<generated::DescribeRequest>,
    ) -> Result<Response<generated::Description>, Status> {
        Ok(Response::new(encode_description(&self.0.description())))
    }

    type RunStream = tokio_stream::Once<Result<RunReply, Status>>;

    async fn run(&self, request: tonic::Request<RunRequest>) -> Result<Response<Self::RunStream>, Status> {
        let served = Arc::clone(&self.0);
        let work = move || {
            let answer =
                decode_run(request.get_ref()).map_err(|error| ParticleError::BadJob(error.to_string()));
            answer.and_then(|request| {
                catch_unwind(AssertUnwindSafe(|| served.run(request)))
                    .unwrap_or_else(|panic| Err(ModelFailure::Solver(panic_text(panic.as_ref())).into()))
            })
        };
        let answer = tokio::task::spawn_blocking(work).await;
        let answer = answer.unwrap_or_else(|error| Err(ParticleError::Undecided(error.to_string())));
        Ok(Response::new(tokio_stream::once(Ok(encode_reply(&Reply::Ended(answer))))))
    }
}

/// Serves a model on a Unix socket until the process ends.
///
/// # Errors
/// When the socket cannot be made.
pub fn serve(model: Served, socket: &Path) -> std::io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = UnixListener::bind(socket)?;
        let service = SolverServer::new(Service(Arc::new(model)))
            .max_decoding_message_size(i32::MAX as usize)
            .max_encoding_message_size(i32::MAX as usize);
        tonic::transport::Server::builder()
            .initial_stream_window_size(WINDOW)
            .initial_connection_window_size(WINDOW)
            .max_frame_size(FRAME_SIZE)
            .add_service(service)
            .serve_with_incoming(UnixListenerStream::new(listener))
            .await
            .map_err(std::io::Error::other)
    })
}
