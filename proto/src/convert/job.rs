//! Jobs, both ways. Next file to read: [`super::windows`], for the windows that they share.

use std::collections::HashMap;
use std::sync::Arc;

use bytes::Bytes;
use starlings_models::{Job, Window};

use super::window;
use super::windows::{self, ReceivedWindows, SentWindows, WindowId};
use super::{Lease, ProtocolError, SetupId, State, floats, required, state};
use crate::{MAX_INLINE_STATE, MAX_MESSAGE, generated};

/// Room left in a message for everything that is no array.
const MESSAGE_MARGIN: usize = 64 * 1024;

/// Encodes jobs and keeps the encoded form of their windows, which all particles of an ensemble share: each is encoded once,
/// and the messages of its jobs refer to the same bytes.
#[derive(Debug, Default)]
pub struct JobEncoder {
    /// By the place of a window in memory, which stays its own for as long as the window is held here.
    windows: HashMap<usize, Encoded>,
    /// The setup of the last job as it travels: the next one has it too, mostly.
    setup: Bytes,
}

#[derive(Debug)]
struct Encoded {
    /// Keeps its place in memory.
    _window: Arc<Window>,
    message: generated::Window,
    /// Where it is too large to travel inside every job.
    name: Option<WindowId>,
}

impl JobEncoder {
    /// Encodes the windows of a batch ahead, so that giving its jobs away copies nothing.
    pub fn of<'a>(jobs: impl IntoIterator<Item = &'a Job<State>>) -> Self {
        let mut encoder = Self::default();
        for job in jobs {
            encoder.window(&job.window);
        }
        encoder
    }

    /// The messages that give one job to a worker: its window, where that is large and was not `sent` on this stream, and the job.
    pub fn encode(
        &mut self,
        lease: Lease,
        setup: &SetupId,
        job: &Job<State>,
        sent: &mut SentWindows,
    ) -> (Option<generated::ToWorker>, generated::ToWorker) {
        if *self.setup != *setup {
            self.setup = Bytes::copy_from_slice(setup);
        }
        let setup = self.setup.clone();
        let window = self.window(&job.window);
        let (ahead, over) = match &window.name {
            Some(id) => {
                let name = Bytes::copy_from_slice(id);
                (windows::ahead(id, &window.message, sent), generated::job::Over::WindowId(name))
            }
            None => (None, generated::job::Over::Window(window.message.clone())),
        };
        let (inside, named) = state::encode(job.state.as_ref());
        let message = generated::Job {
            lease: Some(lease.into()),
            setup,
            particle: job.particle,
            record: job.record,
            over: Some(over),
            theta: floats::encode(&job.theta),
            state: inside,
            state_id: named,
            traceparent: String::new(),
        };
        (ahead, generated::ToWorker { kind: Some(generated::to_worker::Kind::Job(message)) })
    }

    fn window(&mut self, window: &Arc<Window>) -> &Encoded {
        self.windows.entry(Arc::as_ptr(window) as usize).or_insert_with(|| {
            let message = window::encode(window);
            Encoded { _window: Arc::clone(window), name: windows::name(&message), message }
        })
    }
}

/// Whether a job can travel and will be taken at the other end.
///
/// # Errors
/// [`ProtocolError::Shape`] when the window has no times, its arrays do not fit together, or window
/// and parameters exceed a message.
pub fn check_size<S>(job: &Job<S>) -> Result<(), ProtocolError> {
    let window = &job.window;
    window::check(window)?;
    let signals: usize = window.inputs.iter().map(|s| s.times.len() + s.values.len()).sum();
    let bytes = 8 * (window.times.len() + window.observed.len() + signals + job.theta.len());
    if bytes + MAX_INLINE_STATE + MESSAGE_MARGIN > MAX_MESSAGE {
        let limit = MAX_MESSAGE - MAX_INLINE_STATE - MESSAGE_MARGIN;
        let message = format!(
            "{bytes} bytes, at most {limit} fit in a message: use fewer observation times per window"
        );
        return Err(ProtocolError::Shape { field: "window", message });
    }
    Ok(())
}

pub(super) fn decode_job(
    job: &generated::Job,
    received: &mut ReceivedWindows,
) -> Result<Job<State>, ProtocolError> {
    Ok(Job {
        particle: job.particle,
        record: job.record,
        window: match required(job.over.as_ref(), "window")? {
            generated::job::Over::Window(window) => windows::inside(window, received)?,
            generated::job::Over::WindowId(id) => {
                Arc::clone(named(id, received).ok_or(ProtocolError::UnknownWindow)?)
            }
        },
        theta: floats::decode(&job.theta, "theta")?,
        state: state::decode(job.state.as_deref(), job.state_id.as_deref())?,
    })
}

fn named<'a>(id: &[u8], received: &'a ReceivedWindows) -> Option<&'a Arc<Window>> {
    received.get(id.try_into().ok()?)
}
