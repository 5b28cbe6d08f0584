//! What a worker says to the coordinator, both ways.

use bytes::Bytes;
use starlings_models::{ModelFailure, ParticleError, Prediction, Timeout};

use super::block;
use super::held::{HeldRun, decode_held, encode_held};
use super::state::{self, ChunkId, check_inline};
use super::{Lease, ProtocolError, SetupId, State, floats, required, setup_id};
use crate::MAX_SLOTS;
use crate::generated::{self, failure, from_worker::Kind, result::Outcome};
use crate::text::{self, cut};

/// Longest time that a run may say it took, seconds.
const LONGEST_RUN: f64 = 1e7;

/// Who a worker is. First message of every stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Protocol number.
    pub protocol: u32,
    /// Package version.
    pub version: String,
    /// Cores that the worker sees.
    pub cores: u32,
    /// Jobs that it runs at the same time; at least 1, at most [`MAX_SLOTS`].
    pub slots: u32,
    /// Host name.
    pub host: String,
    /// Process number on that host.
    pub pid: u32,
    /// Drawn once per process.
    pub nonce: u64,
    /// BLAKE3 of the executable; `None` when it could not be read.
    pub build: Option<[u8; 32]>,
}

/// How one lease ended on a worker.
#[derive(Clone, Debug, PartialEq)]
pub enum LeaseOutcome {
    /// A prediction, or why there is none.
    Ran(Result<Prediction<State>, ParticleError>),
    /// The job is given back without an answer: it was called back before it started, or told to stop.
    Withdrawn,
}

/// A checked message from a worker.
#[derive(Clone, Debug, PartialEq)]
pub enum FromWorker {
    /// Who it is.
    Hello(Hello),
    /// Whether it could build a setup.
    Setup {
        /// The setup's name.
        id: SetupId,
        /// Built, or why not.
        result: Result<(), String>,
    },
    /// How a lease ended. [`Prediction::cost`] carries the run's wall time; for a failure `cost` does.
    Result {
        /// The lease answered.
        lease: Lease,
        /// How it ended.
        answer: LeaseOutcome,
        /// Wall time of the run, seconds, not negative.
        cost: f64,
    },
    /// The worker is alive.
    Heartbeat {
        /// Jobs being computed.
        running: u32,
        /// Jobs waiting in the worker.
        queued: u32,
    },
    /// The worker leaves on purpose.
    Goodbye(String),
    /// What it finished or still makes for an earlier connection of the same run.
    Held(Vec<HeldRun>),
    /// It shares the place of states that the Welcome told of.
    SharesStates,
    /// The names of the pieces that it made of a block of rows, or why it could not.
    Recombined {
        /// The lease answered.
        lease: Lease,
        /// What came of it.
        made: Result<Vec<ChunkId>, String>,
    },
}

impl FromWorker {
    /// The message to send.
    ///
    /// # Errors
    /// [`ProtocolError::StateTooLarge`] for a prediction whose state does not fit in a message.
    pub fn encode(self) -> Result<generated::FromWorker, ProtocolError> {
        let kind = match self {
            Self::Hello(hello) => Kind::Hello(encode_hello(hello)),
            Self::Setup { id, result } => {
                Kind::Setup(generated::SetupResult { id: Bytes::copy_from_slice(&id), failure: result.err() })
            }
            Self::Result { lease, answer, cost } => {
                let outcome = Some(encode_answer(answer)?);
                Kind::Result(generated::Result { lease: Some(lease.into()), outcome, cost_s: cost })
            }
            Self::Heartbeat { running, queued } => Kind::Heartbeat(generated::Heartbeat { running, queued }),
            Self::Goodbye(reason) => Kind::Goodbye(generated::Goodbye { reason }),
            Self::Held(runs) => Kind::Held(encode_held(runs)),
            Self::SharesStates => Kind::SharesStates(generated::SharesStates {}),
            Self::Recombined { lease, made } => Kind::Recombined(block::encode_made(lease, made)),
        };
        Ok(generated::FromWorker { kind: Some(kind) })
    }

    /// What an encoded message takes on the wire, bytes.
    pub fn wire_size(message: &generated::FromWorker) -> usize {
        prost::Message::encoded_len(message)
    }

    /// Checks a message that arrived.
    ///
    /// # Errors
    /// What is missing or does not fit.
    pub fn decode(message: generated::FromWorker) -> Result<Self, ProtocolError> {
        Ok(match required(message.kind, "kind")? {
            Kind::Hello(hello) => Self::Hello(decode_hello(hello)?),
            Kind::Setup(s) => {
                Self::Setup { id: setup_id(&s.id)?, result: s.failure.map_or(Ok(()), |why| Err(cut(why))) }
            }
            Kind::Result(result) => decode_result(result)?,
            Kind::Heartbeat(h) => Self::Heartbeat { running: h.running, queued: h.queued },
            Kind::Goodbye(g) => Self::Goodbye(cut(g.reason)),
            Kind::Held(held) => Self::Held(decode_held(held)?),
            Kind::SharesStates(_) => Self::SharesStates,
            Kind::Recombined(message) => {
                let (lease, made) = block::decode_made(message)?;
                Self::Recombined { lease, made }
            }
        })
    }
}

fn encode_hello(hello: Hello) -> generated::Hello {
    let Hello { protocol, version, cores, slots, host, pid, nonce, build } = hello;
    let build = build.map_or_else(Bytes::new, |hash| Bytes::copy_from_slice(&hash));
    generated::Hello { protocol, version, cores, slots, host, pid, nonce, build }
}

fn decode_hello(hello: generated::Hello) -> Result<Hello, ProtocolError> {
    let generated::Hello { protocol, version, cores, slots, host, pid, nonce, build } = hello;
    if slots == 0 || slots as usize > MAX_SLOTS {
        let message = format!("{slots}, expected 1 to {MAX_SLOTS}");
        return Err(ProtocolError::Shape { field: "slots", message });
    }
    let build = if build.is_empty() { None } else { Some(setup_id(&build)?) };
    let (host, version) = (text::host(&host), text::host(&version));
    Ok(Hello { protocol, version, cores, slots, host, pid, nonce, build })
}

fn encode_answer(answer: LeaseOutcome) -> Result<Outcome, ProtocolError> {
    Ok(match answer {
        LeaseOutcome::Ran(ended) => {
            if let Ok(Prediction { state: State::Values(values), .. }) = &ended {
                check_inline(values.len())?;
            }
            encode_ended(&ended)
        }
        LeaseOutcome::Withdrawn => Outcome::Withdrawn(generated::Withdrawn {}),
    })
}

pub(super) fn encode_ended(ended: &Result<Prediction<State>, ParticleError>) -> Outcome {
    match ended {
        Ok(prediction) => {
            let (inside, state_id) = state::encode(Some(&prediction.state));
            let (outputs, state) = (floats::encode(&prediction.outputs), inside.unwrap_or_default());
            Outcome::Prediction(generated::Prediction { outputs, state, state_id })
        }
        Err(error) => Outcome::Failure(generated::Failure { kind: Some(encode_failure(error.clone())) }),
    }
}

fn decode_result(result: generated::Result) -> Result<FromWorker, ProtocolError> {
    let lease = required(result.lease, "lease")?.into();
    if let Some(Outcome::Withdrawn(_)) = result.outcome {
        return Ok(FromWorker::Result {
            lease,
            answer: LeaseOutcome::Withdrawn,
            cost: seconds(result.cost_s),
        });
    }
    let (ended, cost) = decode_ended(result)?;
    Ok(FromWorker::Result { lease, answer: LeaseOutcome::Ran(ended), cost })
}

/// How a run ended, and its wall time in seconds.
pub(super) fn decode_ended(
    result: generated::Result,
) -> Result<(Result<Prediction<State>, ParticleError>, f64), ProtocolError> {
    let cost = seconds(result.cost_s);
    let ended = match required(result.outcome, "outcome")? {
        Outcome::Prediction(p) => {
            let state = state::decode(Some(&p.state), p.state_id.as_deref())?.unwrap_or_default();
            Ok(Prediction { outputs: floats::decode(&p.outputs, "outputs")?, state, cost })
        }
        Outcome::Failure(failure) => Err(decode_failure(required(failure.kind, "failure kind")?)?),
        Outcome::Withdrawn(_) => return Err(ProtocolError::Missing("end of the run")),
    };
    Ok((ended, cost))
}

fn seconds(cost: f64) -> f64 {
    if cost > 0.0 { cost.min(LONGEST_RUN) } else { 0.0 }
}

fn encode_failure(error: ParticleError) -> failure::Kind {
    match error {
        ParticleError::Model(failed) => encode_model_failure(failed),
        ParticleError::BadJob(text) => failure::Kind::BadJob(text),
        ParticleError::Infrastructure(text) => failure::Kind::Infrastructure(text),
        ParticleError::Timeout(Timeout { limit, says }) => {
            failure::Kind::Timeout(generated::Timeout { limit_s: Some(limit), says })
        }
        ParticleError::Undecided(text) => failure::Kind::Undecided(text),
    }
}

fn encode_model_failure(failed: ModelFailure) -> failure::Kind {
    match failed {
        ModelFailure::NotFinite { what, time } => {
            failure::Kind::NotFinite(generated::NotFinite { what, time: Some(time) })
        }
        ModelFailure::StepTooSmall { time, step } => {
            failure::Kind::StepTooSmall(generated::StepTooSmall { time: Some(time), step: Some(step) })
        }
        ModelFailure::TooManySteps { time, limit } => {
            failure::Kind::TooManySteps(generated::TooManySteps { time: Some(time), limit })
        }
        ModelFailure::OutsideDomain(text) => failure::Kind::OutsideDomain(text),
        ModelFailure::Solver(text) => failure::Kind::Solver(text),
    }
}

fn decode_failure(kind: failure::Kind) -> Result<ParticleError, ProtocolError> {
    let failed = match kind {
        failure::Kind::BadJob(text) => return Ok(ParticleError::BadJob(cut(text))),
        failure::Kind::Infrastructure(text) => return Ok(ParticleError::Infrastructure(cut(text))),
        failure::Kind::Undecided(text) => return Ok(ParticleError::Undecided(cut(text))),
        failure::Kind::Timeout(f) => {
            return Ok(Timeout { limit: required(f.limit_s, "limit_s")?, says: cut(f.says) }.into());
        }
        failure::Kind::NotFinite(f) => {
            ModelFailure::NotFinite { what: cut(f.what), time: required(f.time, "time")? }
        }
        failure::Kind::StepTooSmall(f) => {
            ModelFailure::StepTooSmall { time: required(f.time, "time")?, step: required(f.step, "step")? }
        }
        failure::Kind::TooManySteps(f) => {
            ModelFailure::TooManySteps { time: required(f.time, "time")?, limit: f.limit }
        }
        failure::Kind::OutsideDomain(text) => ModelFailure::OutsideDomain(cut(text)),
        failure::Kind::Solver(text) => ModelFailure::Solver(cut(text)),
    };
    Ok(failed.into())
}
