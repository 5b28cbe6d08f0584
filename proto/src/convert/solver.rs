//! What a worker and an external solver say to each other, both ways.
//!
//! Next files to read: `proto/solver.proto`, then [`description`] for what a solver says of itself.

pub mod description;

use starlings_models::{Addition, ModelFailure, ObserverDef, ParticleError, Run, Signal, Solved, Window};

use super::{ProtocolError, floats, required};
use crate::generated_solver::{
    self as generated, failure::Kind as FailureKind, run_reply::Kind as ReplyKind,
};

/// Number of the protocol between worker and solver; both must have the same.
pub const SOLVER_PROTOCOL: u32 = 2;

/// One run as a solver receives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record.
    pub record: u32,
    /// Parameters in the order of the description.
    pub parameters: Vec<f64>,
    /// Initial values by the name of the state's component.
    pub initial: Vec<(String, f64)>,
    /// Names of the outputs asked for.
    pub outputs: Vec<String>,
    /// Start, times, observed values and inputs.
    pub window: Window,
    /// The observer.
    pub observer: ObserverDef,
    /// State at the start.
    pub state: Option<Vec<f64>>,
    /// Terms added to the rates of hosted states.
    pub terms: Vec<Addition>,
    /// Values of names in the terms.
    pub constants: Vec<(String, f64)>,
}

/// One message of a solver about a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// The study time reached.
    Progress(f64),
    /// The run's end: what it predicts, or why it does not.
    Ended(Result<Solved, ParticleError>),
}

/// The message that asks for a run; `scratch` is the program's own folder.
pub fn encode_run(run: &Run<'_>, scratch: &str) -> generated::RunRequest {
    let named = |values: &[(String, f64)]| {
        values
            .iter()
            .map(|(name, value)| generated::Named { name: name.clone(), value: Some(*value) })
            .collect()
    };
    let term = |add: &Addition| generated::Term { state: add.to.clone(), expression: add.term.clone() };
    let signal =
        |s: &Signal| generated::Signal { times: floats::encode(&s.times), values: floats::encode(&s.values) };
    generated::RunRequest {
        particle: run.particle,
        record: run.record,
        parameters: floats::encode(run.parameters),
        initial: named(run.initial),
        state: run.state.map(floats::encode),
        start: Some(run.window.start),
        times: floats::encode(&run.window.times),
        outputs: run.outputs.to_vec(),
        observed: floats::encode(&run.window.observed),
        observer: Some(generated::Observer { kind: run.observer.kind.clone(), gain: run.observer.gain }),
        inputs: run.window.inputs.iter().map(signal).collect(),
        terms: run.terms.iter().map(term).collect(),
        constants: named(run.constants),
        scratch: scratch.to_owned(),
        traceparent: run.traceparent.unwrap_or_default().to_owned(),
    }
}

/// A run as a solver receives it.
///
/// # Errors
/// When a field is missing or ragged.
pub fn decode_run(message: &generated::RunRequest) -> Result<Request, ProtocolError> {
    let named = |values: &[generated::Named]| {
        let one = |n: &generated::Named| Ok((n.name.clone(), required(n.value, "value")?));
        values.iter().map(one).collect::<Result<Vec<_>, ProtocolError>>()
    };
    let signal = |s: &generated::Signal| {
        let times = floats::decode(&s.times, "input times")?;
        Ok(Signal { times, values: floats::decode(&s.values, "input values")? })
    };
    let term = |t: &generated::Term| Addition { to: t.state.clone(), term: t.expression.clone() };
    let observer = message.observer.clone().unwrap_or_default();
    Ok(Request {
        particle: message.particle,
        record: message.record,
        parameters: floats::decode(&message.parameters, "parameters")?,
        initial: named(&message.initial)?,
        outputs: message.outputs.clone(),
        window: Window {
            start: required(message.start, "start")?,
            times: floats::decode(&message.times, "times")?,
            observed: floats::decode(&message.observed, "observed")?,
            inputs: message.inputs.iter().map(signal).collect::<Result<_, ProtocolError>>()?,
            since: Vec::new(),
        },
        observer: ObserverDef { kind: observer.kind, gain: observer.gain, ..ObserverDef::default() },
        state: message.state.as_ref().map(|bytes| floats::decode(bytes, "state")).transpose()?,
        terms: message.terms.iter().map(term).collect(),
        constants: named(&message.constants)?,
    })
}

/// The message of a reply.
pub fn encode_reply(reply: &Reply) -> generated::RunReply {
    let failure = |kind: FailureKind, text: String, time| {
        ReplyKind::Failure(generated::Failure { kind: kind.into(), text, time })
    };
    let kind = match reply {
        Reply::Progress(time) => ReplyKind::Progress(generated::Progress { time: Some(*time) }),
        Reply::Ended(Ok(solved)) => ReplyKind::Finished(generated::Finished {
            outputs: floats::encode(&solved.outputs),
            state: floats::encode(&solved.state),
        }),
        Reply::Ended(Err(ParticleError::Model(ModelFailure::NotFinite { what, time }))) => {
            failure(FailureKind::NotFinite, what.clone(), Some(*time))
        }
        Reply::Ended(Err(ParticleError::Model(ModelFailure::OutsideDomain(text)))) => {
            failure(FailureKind::OutsideDomain, text.clone(), None)
        }
        Reply::Ended(Err(ParticleError::Model(failed))) => {
            failure(FailureKind::OutsideDomain, failed.to_string(), None)
        }
        Reply::Ended(Err(ParticleError::BadJob(text))) => {
            failure(FailureKind::BadRequest, text.clone(), None)
        }
        Reply::Ended(Err(ParticleError::Infrastructure(text))) => {
            failure(FailureKind::Unavailable, text.clone(), None)
        }
        Reply::Ended(Err(ParticleError::Undecided(text))) => failure(FailureKind::Solver, text.clone(), None),
        Reply::Ended(Err(ParticleError::Timeout(timeout))) => {
            failure(FailureKind::Solver, timeout.to_string(), None)
        }
    };
    generated::RunReply { kind: Some(kind) }
}

/// A reply of a solver.
///
/// # Errors
/// When it is empty or ragged.
pub fn decode_reply(message: generated::RunReply) -> Result<Reply, ProtocolError> {
    Ok(match required(message.kind, "kind")? {
        ReplyKind::Progress(progress) => Reply::Progress(required(progress.time, "time")?),
        ReplyKind::Finished(finished) => Reply::Ended(Ok(Solved {
            outputs: floats::decode(&finished.outputs, "outputs")?,
            state: floats::decode(&finished.state, "state")?,
        })),
        ReplyKind::Failure(failure) => Reply::Ended(Err(match failure.kind() {
            FailureKind::NotFinite => {
                let time = failure.time.unwrap_or(f64::NAN);
                ModelFailure::NotFinite { what: failure.text, time }.into()
            }
            FailureKind::OutsideDomain => ModelFailure::OutsideDomain(failure.text).into(),
            FailureKind::BadRequest => ParticleError::BadJob(failure.text),
            FailureKind::Unavailable => ParticleError::Infrastructure(failure.text),
            FailureKind::Solver => ParticleError::Undecided(failure.text),
        })),
    })
}
