//! Any model behind a UM-Bridge server: HTTP and JSON, one server per slot, or one for all at a fixed address.
//!
//! The parameters go in the order of the description, cut into the vectors that the server asks for. The configuration of a run
//! holds `start`, `times`, `inputs` and `initial`. The answer holds one value per output and time: all outputs of the first
//! time, then of the second, or one vector per output. The server keeps no state, so every run starts anew. Next files to read:
//! [`pool`], [`server`], [`client`], [`answer`].

mod answer;
mod client;
mod pool;
mod server;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Map, Value, json};
use starlings_models::{Description, ParticleError, Quantity, Run, SOLVER, Solved, SolverDef, Spec, Timeout};
use starlings_proto::adapters::{AdapterDef, NamedBy};

use super::Adapter;
use crate::SolverError;
use crate::losses::Losses;
use crate::site::Site;
use crate::stopped::stopped;
use answer::asked;
pub(crate) use answer::rows;
use client::Trouble;
use pool::Pool;
use server::Server;

/// What it says of itself.
pub(crate) const DEF: AdapterDef = AdapterDef {
    name: "um-bridge",
    says: "a UM-Bridge server over HTTP, started by the worker or by somebody else",
    describes_itself: false,
    per_run: false,
    named_by: NamedBy::Address("where the server listens, such as \"http://127.0.0.1:4242\""),
    keys: &["address", "model", "described", "parameters", "outputs", "inputs"],
};

/// Servers that the command of the definition starts, or one at its address.
///
/// # Errors
/// When the study lacks what it needs.
pub(super) fn open(def: &SolverDef, site: &Arc<Site>) -> Result<Box<dyn Adapter>, SolverError> {
    Ok(Box::new(UmBridge::new(def, site)?))
}

/// Servers with one of their models.
struct UmBridge {
    def: SolverDef,
    pool: Pool,
    described: Mutex<Option<Description>>,
}

/// How an attempt ended that gave no answer.
enum Failed {
    /// The server has said that it fails, or answered nonsense.
    Said(String),
    /// It did not answer in time.
    Late(String),
    /// The server ended by itself.
    Fell(String),
    /// The connection broke while the server ran on.
    Unreached(String),
    /// There is no server.
    Missing(String),
    /// Somebody killed the server.
    Killed(String),
    /// Somebody stopped the server, so that it did not answer in time.
    Stopped(String),
}

impl UmBridge {
    fn new(def: &SolverDef, site: &Arc<Site>) -> Result<Self, SolverError> {
        if def.command.is_empty() && def.address.is_none() {
            let message =
                "a UM-Bridge model needs an `address`, such as http://127.0.0.1:4242, or a `command`";
            return Err(SolverError::Incomplete(message.to_owned()));
        }
        Ok(Self { def: def.clone(), pool: Pool::new(def, site), described: Mutex::default() })
    }

    fn patience(&self) -> Duration {
        Duration::try_from_secs_f64(self.def.timeout).unwrap_or(Duration::MAX)
    }

    fn attempt(&self, run: &Run<'_>, spec: &Spec) -> Result<Solved, Failed> {
        let taken = self.pool.take().map_err(|error| Failed::Missing(error.to_string()))?;
        let server = Arc::clone(&taken.server);
        let question = question(&server, run, spec);
        let trouble = match server.client.ask("/Evaluate", &question, self.patience()) {
            Ok(answer) => {
                self.pool.give_back(taken);
                let rows = rows(&answer, spec, run.window.times.len());
                let rows = rows.map_err(|what| Failed::Said(format!("{} {what}", server.name())))?;
                return Ok(Solved { outputs: asked(&rows, spec, run.outputs), state: Vec::new() });
            }
            Err(trouble) => trouble,
        };
        let text = format!("{} {trouble}", server.name());
        match trouble {
            Trouble::Silent { .. } => {
                let (is_stopped, tail) = (server.is_stopped(), server.tail());
                // It may work on that run for long: one that was started here is ended.
                server.end();
                Err(if is_stopped {
                    Failed::Stopped(stopped(&server.name(), self.def.timeout) + &tail)
                } else {
                    Failed::Late(format!("{text} (`timeout` sets the limit){tail}"))
                })
            }
            Trouble::Connection { .. } => {
                if let Some((killed, ending)) = server.ending() {
                    server.end();
                    let text = format!("{text}; {ending}");
                    return Err(if killed { Failed::Killed(text) } else { Failed::Fell(text) });
                }
                // The network failed, or the server gave this run up without an answer: once more.
                let text = text + &server.tail();
                self.pool.give_back(taken);
                Err(Failed::Unreached(text))
            }
            Trouble::Said(..) | Trouble::Garbage { .. } => {
                let text = text + &server.tail();
                self.pool.give_back(taken);
                Err(Failed::Said(text))
            }
        }
    }

    /// What the study says, completed by what this server says.
    fn described_by(&self, server: &Server) -> Result<Description, SolverError> {
        let wrong = |message| SolverError::Description { program: server.client.url().to_owned(), message };
        let mut description = self.def.described.clone().unwrap_or_default();
        let spec = &mut description.spec;
        let n: usize = server.input_sizes.iter().sum();
        if spec.parameters.is_empty() {
            spec.parameters = numbered("p", n);
        }
        let given: usize = spec.parameters.iter().map(|q| q.size).sum();
        if given != n {
            let sizes = &server.input_sizes;
            let what =
                format!("{} takes {n} values ({sizes:?}), the study has {given} parameters", server.name());
            return Err(wrong(what));
        }
        if spec.outputs.is_empty() {
            let sizes = server.client.sizes("/OutputSizes", "outputSizes", &server.model, self.patience());
            let sizes = sizes.map_err(|trouble| wrong(format!("{} {trouble}", server.name())))?;
            spec.outputs = numbered("y", sizes.iter().sum());
        }
        SOLVER.clone_into(&mut spec.kind);
        if self.def.described.is_none() {
            description.deterministic = true;
        }
        if description.name.is_empty() {
            description.name.clone_from(&server.model);
        }
        let mut known = self.described.lock().unwrap_or_else(PoisonError::into_inner);
        *known = Some(description.clone());
        Ok(description)
    }
}

impl Adapter for UmBridge {
    fn describe(&self) -> Result<Description, SolverError> {
        let taken = self.pool.take()?;
        let described = self.described_by(&taken.server);
        self.pool.give_back(taken);
        described
    }

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        if run.state.is_some() {
            let message = "a state for a UM-Bridge model, which starts every run anew".to_owned();
            return Err(ParticleError::BadJob(message));
        }
        let known = self.described.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let description = match known.map_or_else(|| self.describe(), Ok) {
            Ok(description) => description,
            Err(error) => return Err(ParticleError::Infrastructure(error.to_string())),
        };
        let (given, wanted) = (run.parameters.len(), description.spec.parameters.len());
        if given != wanted {
            let name = &description.name;
            let message = format!("{given} parameters for the model `{name}`, which takes {wanted}");
            return Err(ParticleError::BadJob(message));
        }
        let mut losses = Losses::default();
        loop {
            let failed = match self.attempt(run, &description.spec) {
                Ok(solved) => return Ok(solved),
                Err(failed) => failed,
            };
            let again = match &failed {
                Failed::Killed(_) => losses.killed(),
                Failed::Fell(_) | Failed::Unreached(_) => losses.fell(),
                Failed::Said(_) | Failed::Late(_) | Failed::Missing(_) | Failed::Stopped(_) => false,
            };
            if !again {
                return Err(match failed {
                    Failed::Said(text) | Failed::Fell(text) => ParticleError::Undecided(text),
                    Failed::Late(says) => Timeout { limit: self.def.timeout, says }.into(),
                    Failed::Unreached(text)
                    | Failed::Missing(text)
                    | Failed::Killed(text)
                    | Failed::Stopped(text) => ParticleError::Infrastructure(text),
                });
            }
            tracing::warn!(
                particle = run.particle,
                record = run.record,
                losses = losses.total(),
                "made again"
            );
        }
    }
}

/// Names for what the study does not name.
fn numbered(letter: &str, n: usize) -> Vec<Quantity> {
    (1..=n).map(|i| Quantity::new(&format!("{letter}{i}"), "")).collect()
}

/// What the server is asked for a run.
fn question(server: &Server, run: &Run<'_>, spec: &Spec) -> Value {
    let mut rest = run.parameters;
    let vectors = server.input_sizes.iter().map(|size| {
        let (vector, after) = rest.split_at((*size).min(rest.len()));
        rest = after;
        vector
    });
    let vectors: Vec<&[f64]> = vectors.collect();
    let window = run.window;
    let inputs = spec
        .inputs
        .iter()
        .zip(&window.inputs)
        .map(|(q, signal)| (q.name.clone(), json!({ "times": signal.times, "values": signal.values })));
    let initial = run.initial.iter().map(|(name, value)| (name.clone(), json!(value)));
    let config = json!({
        "start": window.start,
        "times": window.times,
        "inputs": inputs.collect::<Map<String, Value>>(),
        "initial": initial.collect::<Map<String, Value>>(),
    });
    json!({ "name": server.model, "input": vectors, "config": config })
}
