//! What the coordinator says to a worker, both ways.

use bytes::Bytes;
use starlings_models::{Job, Setup};

use super::block::{self, Block};
use super::held::{decode_adopted, encode_adopted};
use super::key::JobKey;
use super::{
    Lease, ProtocolError, ReceivedWindows, SetupId, State, decode_setup, hash, job, required, setup_id,
    windows,
};
use crate::generated::{self, to_worker::Kind};
use crate::text::cut;

/// The coordinator takes the worker.
#[derive(Clone, Debug, PartialEq)]
pub struct Welcome {
    /// Protocol number of the coordinator.
    pub protocol: u32,
    /// Name of the run.
    pub run: String,
    /// Seconds between heartbeats, both ways; positive.
    pub heartbeat: f64,
    /// Number of this stream, carried by every lease given on it.
    pub epoch: u64,
    /// Drawn once per run.
    pub run_id: [u8; 16],
    /// How often the run was started, from 1.
    pub incarnation: u64,
    /// Name of a piece in the run's folder of the place that machines share; `None` where none is shared.
    pub probe: Option<[u8; 32]>,
}

/// A checked message to a worker. Jobs are encoded by [`super::JobEncoder`], everything else by the functions here.
#[derive(Clone, Debug, PartialEq)]
pub enum ToWorker {
    /// The worker is taken.
    Welcome(Welcome),
    /// The worker is not taken: why, with the remedy.
    Refuse(String),
    /// A setup to build, or why its text cannot be read.
    Setup {
        /// Its name.
        id: SetupId,
        /// The setup, or what is wrong with it.
        setup: Result<Box<Setup>, ProtocolError>,
    },
    /// A window that jobs will name: it is kept.
    Window,
    /// A job to run.
    Job {
        /// The right to answer.
        lease: Lease,
        /// The setup to run it with.
        setup: SetupId,
        /// The job.
        job: Job<State>,
        /// Where it belongs in a trace.
        traceparent: Option<String>,
    },
    /// Withdraw these jobs.
    Cancel {
        /// Which.
        leases: Vec<Lease>,
        /// Also those that are being computed.
        stop: bool,
    },
    /// The coordinator is alive.
    Heartbeat,
    /// The run is over: leave.
    Drain(String),
    /// Leases for runs that the worker still makes.
    Adopt {
        /// The runs.
        runs: Vec<(JobKey, Lease)>,
        /// What waits in the worker and has no lease on this stream is of no use.
        rest_is_void: bool,
    },
    /// For whoever watches the worker.
    Notice(String),
    /// A block of rows to mix in the shared folder.
    Recombine {
        /// The right to answer.
        lease: Lease,
        /// The block.
        block: Block,
    },
}

/// Letters of a `traceparent`; one of another length is none.
const TRACEPARENT: usize = 55;

/// What a message takes at least, with what is shared at most a little.
const LEAST: usize = 1024;

impl ToWorker {
    /// The message for [`ToWorker::Welcome`].
    pub fn welcome(welcome: Welcome) -> generated::ToWorker {
        let Welcome { protocol, run, heartbeat, epoch, run_id, incarnation, probe } = welcome;
        let run_id = Bytes::copy_from_slice(&run_id);
        let probe = probe.map_or_else(Bytes::new, |name| Bytes::copy_from_slice(&name));
        let welcome = generated::Welcome { protocol, run, heartbeat, epoch, run_id, incarnation, probe };
        message(Kind::Welcome(welcome))
    }

    /// The message for [`ToWorker::Refuse`].
    pub fn refuse(reason: &str) -> generated::ToWorker {
        message(Kind::Refuse(generated::Refuse { reason: reason.to_owned() }))
    }

    /// The message for [`ToWorker::Setup`], from the text made by [`super::encode_setup`].
    pub fn setup(id: &SetupId, json: Bytes) -> generated::ToWorker {
        message(Kind::Setup(generated::SetupMsg { id: Bytes::copy_from_slice(id), json }))
    }

    /// A message for [`ToWorker::Job`] that says where its run belongs in a trace.
    pub fn traced(mut message: generated::ToWorker, traceparent: String) -> generated::ToWorker {
        if let Some(Kind::Job(job)) = &mut message.kind {
            job.traceparent = traceparent;
        }
        message
    }

    /// The message for [`ToWorker::Cancel`].
    pub fn cancel(leases: &[Lease], stop: bool) -> generated::ToWorker {
        let leases = leases.iter().copied().map(Into::into).collect();
        message(Kind::Cancel(generated::Cancel { leases, stop }))
    }

    /// The message for [`ToWorker::Heartbeat`].
    pub fn heartbeat() -> generated::ToWorker {
        message(Kind::Heartbeat(generated::Heartbeat { running: 0, queued: 0 }))
    }

    /// The message for [`ToWorker::Drain`].
    pub fn drain(reason: &str) -> generated::ToWorker {
        message(Kind::Drain(generated::Drain { reason: reason.to_owned() }))
    }

    /// The message for [`ToWorker::Adopt`].
    pub fn adopt(runs: &[(JobKey, Lease)], rest_is_void: bool) -> generated::ToWorker {
        message(Kind::Adopt(encode_adopted(runs, rest_is_void)))
    }

    /// The message for [`ToWorker::Notice`].
    pub fn notice(text: &str) -> generated::ToWorker {
        message(Kind::Notice(generated::Notice { text: text.to_owned() }))
    }

    /// The message for [`ToWorker::Recombine`]; `transform` as [`super::floats::encode`] makes it.
    pub fn recombine(
        lease: Lease,
        rows: usize,
        pieces: &[[u8; 32]],
        transform: Bytes,
    ) -> generated::ToWorker {
        message(Kind::Recombine(block::encode(lease, rows, pieces, transform)))
    }

    /// Bytes that a message takes for itself while it waits to be sent: texts and windows are shared with other messages.
    pub fn weight(message: &generated::ToWorker) -> usize {
        let own = match &message.kind {
            Some(Kind::Job(job)) => job.theta.len() + job.state.as_ref().map_or(0, Bytes::len),
            Some(Kind::Recombine(block)) => block.pieces.len(),
            Some(Kind::Adopt(adopt)) => adopt.runs.len() * size_of::<(generated::Adopted, JobKey)>(),
            Some(Kind::Cancel(cancel)) => cancel.leases.len() * size_of::<generated::Lease>(),
            _ => 0,
        };
        LEAST + own
    }

    /// Checks a message that arrived on a stream of which these windows were `received` before.
    ///
    /// # Errors
    /// What is missing or does not fit; [`ProtocolError::Job`] where the lease is good and can be answered.
    pub fn decode(
        message: generated::ToWorker,
        received: &mut ReceivedWindows,
    ) -> Result<Self, ProtocolError> {
        Ok(match required(message.kind, "kind")? {
            Kind::Welcome(w) => Self::Welcome(decode_welcome(w)?),
            Kind::Refuse(r) => Self::Refuse(cut(r.reason)),
            Kind::Setup(s) => {
                let id = setup_id(&s.id)?;
                Self::Setup { id, setup: decode_setup(&id, &s.json).map(Box::new) }
            }
            Kind::Window(window) => {
                windows::receive(&window, received)?;
                Self::Window
            }
            Kind::Job(job) => decode_job(&job, received)?,
            Kind::Cancel(c) => {
                Self::Cancel { leases: c.leases.into_iter().map(Into::into).collect(), stop: c.stop }
            }
            Kind::Heartbeat(_) => Self::Heartbeat,
            Kind::Drain(d) => Self::Drain(cut(d.reason)),
            Kind::Adopt(a) => {
                let rest_is_void = a.rest_is_void;
                Self::Adopt { runs: decode_adopted(a)?, rest_is_void }
            }
            Kind::Notice(n) => Self::Notice(cut(n.text)),
            Kind::Recombine(message) => {
                let (lease, block) = block::decode(&message)?;
                Self::Recombine { lease, block }
            }
        })
    }
}

fn message(kind: Kind) -> generated::ToWorker {
    generated::ToWorker { kind: Some(kind) }
}

fn decode_welcome(welcome: generated::Welcome) -> Result<Welcome, ProtocolError> {
    let generated::Welcome { protocol, run, heartbeat, epoch, run_id, incarnation, probe } = welcome;
    if !(0.01..=3600.0).contains(&heartbeat) {
        return Err(ProtocolError::Shape {
            field: "heartbeat",
            message: format!("{heartbeat} s, expected 0.01 s to an hour"),
        });
    }
    let run_id = run_id.as_ref().try_into().map_err(|_| ProtocolError::Shape {
        field: "run id",
        message: format!("has {} bytes, expected 16", run_id.len()),
    })?;
    let probe = if probe.is_empty() { None } else { Some(hash(&probe, "probe")?) };
    Ok(Welcome { protocol, run: cut(run), heartbeat, epoch, run_id, incarnation, probe })
}

fn decode_job(wire_job: &generated::Job, received: &mut ReceivedWindows) -> Result<ToWorker, ProtocolError> {
    let lease: Lease = required(wire_job.lease, "lease")?.into();
    let decoded =
        setup_id(&wire_job.setup).and_then(|setup| Ok((setup, job::decode_job(wire_job, received)?)));
    match decoded {
        Ok((setup, job)) => {
            let traceparent = Some(&wire_job.traceparent).filter(|text| text.len() == TRACEPARENT).cloned();
            Ok(ToWorker::Job { lease, setup, job, traceparent })
        }
        // The stream is broken, not the job.
        Err(ProtocolError::UnknownWindow) => Err(ProtocolError::UnknownWindow),
        Err(source) => Err(ProtocolError::Job { lease, source: Box::new(source) }),
    }
}
