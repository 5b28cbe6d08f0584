//! Jobs and windows, both ways.

use std::collections::HashMap;
use std::sync::Arc;

use starlings_models::{Job, Signal, Window};

use super::{Lease, SetupId, WireError, floats, required};
use crate::{MAX_INLINE_STATE, MAX_MESSAGE, wire};

/// Room left in a message for everything that is no array.
const MESSAGE_MARGIN: usize = 64 * 1024;

/// Encodes jobs and keeps the encoded form of their windows, which all particles of an ensemble share: each is encoded once,
/// and the messages of its jobs refer to the same bytes.
#[derive(Debug, Default)]
pub struct JobEncoder {
    /// By the place of a window in memory, which stays its own for as long as the window is held here.
    windows: HashMap<usize, (Arc<Window>, wire::Window)>,
}

impl JobEncoder {
    /// Encodes the windows of a batch ahead, so that giving its jobs away copies nothing.
    pub fn of<'a>(jobs: impl IntoIterator<Item = &'a Job>) -> Self {
        let mut encoder = Self::default();
        for job in jobs {
            encoder.window(&job.window);
        }
        encoder
    }

    /// The message that gives one job to a worker.
    pub fn encode(&mut self, lease: Lease, setup: &SetupId, job: &Job) -> wire::ToWorker {
        let message = wire::Job {
            lease: Some(lease.into()),
            setup: bytes::Bytes::copy_from_slice(setup),
            particle: job.particle,
            record: job.record,
            window: Some(self.window(&job.window)),
            theta: floats::encode(&job.theta),
            state: job.state.as_deref().map(floats::encode),
        };
        wire::ToWorker { kind: Some(wire::to_worker::Kind::Job(message)) }
    }

    fn window(&mut self, window: &Arc<Window>) -> wire::Window {
        let place = Arc::as_ptr(window) as usize;
        let known = self.windows.entry(place).or_insert_with(|| (Arc::clone(window), encode_window(window)));
        known.1.clone()
    }
}

/// Whether a job can travel in one message and will be taken at the other end.
///
/// # Errors
/// [`WireError::StateTooLarge`], or [`WireError::Shape`] when the window has no times, its arrays do not fit together, or window
/// and parameters exceed a message.
pub fn check_size(job: &Job) -> Result<(), WireError> {
    check_state(job.state.as_deref().unwrap_or_default())?;
    let window = &job.window;
    check_window(window)?;
    let signals: usize = window.inputs.iter().map(|s| s.times.len() + s.values.len()).sum();
    let bytes = 8 * (window.times.len() + window.observed.len() + signals + job.theta.len());
    if bytes + MAX_INLINE_STATE + MESSAGE_MARGIN > MAX_MESSAGE {
        let limit = MAX_MESSAGE - MAX_INLINE_STATE - MESSAGE_MARGIN;
        let message = format!(
            "{bytes} bytes, at most {limit} fit in a message: use fewer observation times per window"
        );
        return Err(WireError::Shape { field: "window", message });
    }
    Ok(())
}

pub(super) fn check_state(state: &[f64]) -> Result<(), WireError> {
    let bytes = state.len() * 8;
    if bytes > MAX_INLINE_STATE {
        return Err(WireError::StateTooLarge { bytes, limit: MAX_INLINE_STATE });
    }
    Ok(())
}

fn encode_window(window: &Window) -> wire::Window {
    wire::Window {
        start: Some(window.start),
        times: floats::encode(&window.times),
        observed: floats::encode(&window.observed),
        inputs: window
            .inputs
            .iter()
            .map(|s| wire::Signal { times: floats::encode(&s.times), values: floats::encode(&s.values) })
            .collect(),
    }
}

pub(super) fn decode_job(job: &wire::Job) -> Result<Job, WireError> {
    let state = job.state.as_ref().map(|bytes| floats::decode(bytes, "state")).transpose()?;
    check_state(state.as_deref().unwrap_or_default())?;
    Ok(Job {
        particle: job.particle,
        record: job.record,
        window: Arc::new(decode_window(required(job.window.as_ref(), "window")?)?),
        theta: floats::decode(&job.theta, "theta")?,
        state,
    })
}

fn decode_window(window: &wire::Window) -> Result<Window, WireError> {
    let times = floats::decode(&window.times, "times")?;
    let observed = floats::decode(&window.observed, "observed")?;
    let inputs = window.inputs.iter().map(decode_signal).collect::<Result<_, _>>()?;
    let window = Window { start: required(window.start, "start")?, times, observed, inputs };
    check_window(&window)?;
    Ok(window)
}

fn check_window(window: &Window) -> Result<(), WireError> {
    let Window { times, observed, inputs, .. } = window;
    if times.is_empty() {
        return Err(WireError::Shape { field: "times", message: "a window needs at least one".to_owned() });
    }
    if observed.len() % times.len() != 0 {
        let message = format!("{} values for {} times", observed.len(), times.len());
        return Err(WireError::Shape { field: "observed", message });
    }
    if let Some(signal) = inputs.iter().find(|signal| signal.times.len() != signal.values.len()) {
        let message = format!("{} values for {} times", signal.values.len(), signal.times.len());
        return Err(WireError::Shape { field: "input", message });
    }
    Ok(())
}

fn decode_signal(signal: &wire::Signal) -> Result<Signal, WireError> {
    let times = floats::decode(&signal.times, "input times")?;
    let values = floats::decode(&signal.values, "input values")?;
    Ok(Signal { times, values })
}
