//! Any model behind a UM-Bridge server: HTTP and JSON, one server for all slots of a worker.
//!
//! The parameters go in the order of the description, cut into the vectors that the server asks for. The configuration of a run
//! holds `start`, `times`, `inputs` and `initial`. The answer holds one value per output and time: all outputs of the first
//! time, then of the second, or one vector per output. The server keeps no state, so every run starts anew. Next files to read:
//! [`server`] and [`client`].

mod client;
mod server;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Map, Value, json};
use starlings_models::{Description, ParticleError, Quantity, Run, SOLVER, Solved, SolverDef, Spec};

use super::{Adapter, Kind};
use crate::solver::SolverError;
use crate::solver::backoff::Backoff;
use crate::solver::site::Site;
use client::Trouble;
use server::Server;

pub(crate) const KIND: Kind = Kind {
    name: "um-bridge",
    says: "a UM-Bridge server over HTTP, started by the worker or by somebody else",
    asks: false,
    open: |def, site| Ok(Box::new(UmBridge::new(def, site)?)),
};

/// Times that a run is made when the server dies: more often when it was killed from outside than when it fell by itself.
const KILLED: u32 = 12;
const FELL: u32 = 2;

/// A server with one of its models.
struct UmBridge {
    def: SolverDef,
    site: Arc<Site>,
    server: Mutex<Option<Arc<Server>>>,
    backoff: Mutex<Backoff>,
    described: Mutex<Option<Description>>,
}

/// How an attempt ended that gave no answer.
enum Failed {
    /// The server has given an answer that would come again, or cannot be reached.
    Here(String),
    /// The server ended by itself.
    Fell(String),
    /// Somebody killed the server.
    Killed(String),
}

impl UmBridge {
    fn new(def: &SolverDef, site: &Arc<Site>) -> Result<Self, SolverError> {
        if def.command.is_empty() && def.address.is_none() {
            let message =
                "a UM-Bridge model needs an `address`, such as http://127.0.0.1:4242, or a `command`";
            return Err(SolverError::Incomplete(message.to_owned()));
        }
        let (server, backoff, described) = (Mutex::default(), Mutex::default(), Mutex::default());
        Ok(Self { def: def.clone(), site: Arc::clone(site), server, backoff, described })
    }

    /// The server, started anew where its program has ended.
    fn server(&self) -> Result<Arc<Server>, SolverError> {
        let mut held = self.server.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(server) = held.as_ref().filter(|server| !server.has_ended()) {
            return Ok(Arc::clone(server));
        }
        *held = None;
        let mut backoff = self.backoff.lock().unwrap_or_else(PoisonError::into_inner);
        let mut kills = 0;
        let server = loop {
            std::thread::sleep(backoff.pause());
            match Server::start(&self.def, &self.site) {
                Ok(server) => break Arc::new(server),
                Err(error) => {
                    backoff.failed();
                    kills += 1;
                    if kills >= KILLED || !matches!(error, SolverError::NotReady { killed: true, .. }) {
                        return Err(error);
                    }
                }
            }
        };
        backoff.worked();
        *held = Some(Arc::clone(&server));
        Ok(server)
    }

    /// Puts a server away that is of no more use; one that has taken its place stays.
    fn forget(&self, server: &Arc<Server>) {
        server.end();
        let mut held = self.server.lock().unwrap_or_else(PoisonError::into_inner);
        if held.as_ref().is_some_and(|other| Arc::ptr_eq(other, server)) {
            *held = None;
        }
    }

    fn patience(&self) -> Duration {
        Duration::try_from_secs_f64(self.def.timeout).unwrap_or(Duration::MAX)
    }

    fn attempt(&self, run: &Run<'_>, spec: &Spec) -> Result<Solved, Failed> {
        let server = self.server().map_err(|error| Failed::Here(error.to_string()))?;
        let question = question(&server, run, spec);
        let trouble = match server.client.ask("/Evaluate", &question, self.patience()) {
            Ok(answer) => {
                let rows = rows(&answer, spec, run.window.times.len());
                let rows = rows.map_err(|what| Failed::Here(format!("{} {what}", server.name())))?;
                return Ok(Solved { outputs: asked(&rows, spec, run.outputs), state: Vec::new() });
            }
            Err(trouble) => trouble,
        };
        let text = format!("{} {trouble}", server.name());
        match trouble {
            Trouble::Silent { .. } => {
                let text = format!("{text} (`timeout` sets the limit){}", server.tail());
                // It may work on that run for long: one that was started here is ended.
                self.forget(&server);
                Err(Failed::Here(text))
            }
            Trouble::Connection { .. } => match server.ending() {
                Some((killed, ending)) => {
                    self.forget(&server);
                    let text = format!("{text}; {ending}");
                    Err(if killed { Failed::Killed(text) } else { Failed::Fell(text) })
                }
                // Another slot may have ended the server, or the network failed: once more.
                None => Err(Failed::Fell(text + &server.tail())),
            },
            Trouble::Said(..) | Trouble::Garbage { .. } => Err(Failed::Here(text + &server.tail())),
        }
    }
}

impl Adapter for UmBridge {
    fn describe(&self) -> Result<Description, SolverError> {
        let server = self.server()?;
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

    fn run(&self, run: &Run<'_>) -> Result<Solved, ParticleError> {
        let failed = |text: String| Err(ParticleError::Solver(text));
        if run.state.is_some() {
            let message = "a state for a UM-Bridge model, which starts every run anew".to_owned();
            return Err(ParticleError::BadJob(message));
        }
        let known = self.described.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let description = match known.map_or_else(|| self.describe(), Ok) {
            Ok(description) => description,
            Err(error) => return failed(error.to_string()),
        };
        let mut losses = 0;
        loop {
            losses += 1;
            match self.attempt(run, &description.spec) {
                Ok(solved) => return Ok(solved),
                Err(Failed::Killed(text)) if losses < KILLED => {
                    tracing::warn!(particle = run.particle, record = run.record, losses, "{text}");
                }
                Err(Failed::Fell(text)) if losses < FELL => {
                    tracing::warn!(particle = run.particle, record = run.record, losses, "{text}");
                }
                Err(Failed::Here(text) | Failed::Fell(text) | Failed::Killed(text)) => return failed(text),
            }
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

/// The values of all outputs, one time after the other.
fn rows(answer: &Value, spec: &Spec, n_times: usize) -> Result<Vec<f64>, String> {
    let vector = |value: &Value| -> Option<Vec<f64>> {
        let number = |v: &Value| if v.is_null() { Some(f64::NAN) } else { v.as_f64() };
        value.as_array()?.iter().map(number).collect()
    };
    let vectors =
        answer["output"].as_array().and_then(|list| list.iter().map(vector).collect::<Option<Vec<_>>>());
    let vectors = vectors.ok_or_else(|| {
        let text: String = answer.to_string().chars().take(200).collect();
        format!("answered without a list of vectors of numbers in `output`: {text}")
    })?;
    let (n, got) = (spec.n_output(), vectors.iter().map(Vec::len).sum::<usize>());
    if got != n * n_times {
        let names: Vec<&str> = spec.outputs.iter().map(|q| q.name.as_str()).collect();
        return Err(format!(
            "answered {got} values where {} belong: {n} ({}) for each of {n_times} times; it must look at `times` in the \
             configuration, or the study at fewer times",
            n * n_times,
            names.join(", ")
        ));
    }
    let sizes = spec.outputs.iter().map(|q| q.size);
    let one_each = vectors.len() > 1
        && vectors.len() == spec.outputs.len()
        && vectors.iter().zip(sizes).all(|(vector, size)| vector.len() == size * n_times);
    if !one_each {
        return Ok(vectors.concat());
    }
    let at = |j: usize| {
        let parts = vectors.iter().zip(&spec.outputs);
        parts.flat_map(move |(vector, q)| &vector[j * q.size..(j + 1) * q.size])
    };
    Ok((0..n_times).flat_map(at).copied().collect())
}

/// The rows of the outputs that were asked for.
fn asked(rows: &[f64], spec: &Spec, names: &[String]) -> Vec<f64> {
    let ranges: Vec<_> = names.iter().filter_map(|name| Spec::range_of(&spec.outputs, name)).collect();
    let columns = rows.chunks_exact(spec.n_output().max(1));
    columns.flat_map(|column| ranges.iter().flat_map(|range| &column[range.clone()])).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec() -> Spec {
        let outputs = vec![Quantity::new("tip", "m"), Quantity::new("wall", "m").size(2)];
        Spec { outputs, ..Spec::default() }
    }

    #[test]
    fn one_vector_holds_a_row_per_time_and_several_one_output_each() {
        let row_per_time = json!({ "output": [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]] });
        let one_each = json!({ "output": [[1.0, 4.0], [2.0, 3.0, 5.0, 6.0]] });
        for answer in [row_per_time, one_each] {
            assert_eq!(rows(&answer, &spec(), 2).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        }
        let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(asked(&all, &spec(), &["wall".to_owned()]), [2.0, 3.0, 5.0, 6.0]);
    }

    #[test]
    fn a_wrong_number_of_values_is_said_with_what_belongs() {
        let says = rows(&json!({ "output": [[1.0, 2.0]] }), &spec(), 2).unwrap_err();
        assert!(says.contains("2 values where 6 belong: 3 (tip, wall) for each of 2 times"), "{says}");
        assert!(rows(&json!({ "output": [1.0] }), &spec(), 1).unwrap_err().contains("list of vectors"));
    }
}
