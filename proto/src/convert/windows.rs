//! Large windows travel once on a stream, ahead of the first job that needs them and under a name; both ends keep the same ones.
//!
//! All particles of an ensemble share their windows, and the window of a long recording is more than all else that a job says.
//! What is kept follows from the order of sending alone, so that the sender knows what the receiver has without being told. Next
//! file to read: [`super::job`].

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use prost::Message;
use starlings_models::Window;

use super::{ProtocolError, window};
use crate::generated;

/// Name of a window: BLAKE3 of its arrays with their lengths.
pub(crate) type WindowId = [u8; 32];

/// Largest window that travels inside its jobs, encoded bytes.
const INLINE: usize = 16 * 1024;

/// Encoded bytes of the named windows that both ends keep, or one window where that is larger.
const KEPT: usize = 32 * 1024 * 1024;

/// The named windows of one stream, as one end holds them: those sent last.
#[derive(Debug)]
pub struct Windows<T> {
    held: HashMap<WindowId, (usize, T)>,
    order: VecDeque<WindowId>,
    bytes: usize,
    /// The last one that came inside a job, as it came and as it was read: the next job has it too, mostly.
    inside: Option<(generated::Window, T)>,
}

/// What the coordinator notes of the windows that it has sent on a stream.
pub type SentWindows = Windows<()>;

/// The windows that a worker has received on a stream.
pub type ReceivedWindows = Windows<Arc<Window>>;

impl<T> Default for Windows<T> {
    fn default() -> Self {
        Self { held: HashMap::new(), order: VecDeque::new(), bytes: 0, inside: None }
    }
}

impl<T> Windows<T> {
    /// What is held under a name.
    pub(crate) fn get(&self, id: &WindowId) -> Option<&T> {
        self.held.get(id).map(|(_, window)| window)
    }

    /// Notes a window of so many encoded bytes as the one sent last; the first ones make room for it.
    pub(super) fn keep(&mut self, id: WindowId, bytes: usize, window: T) {
        if self.held.insert(id, (bytes, window)).is_some() {
            return;
        }
        self.order.push_back(id);
        self.bytes += bytes;
        while self.bytes > KEPT && self.order.len() > 1 {
            let Some((bytes, _)) = self.order.pop_front().and_then(|first| self.held.remove(&first)) else {
                break;
            };
            self.bytes -= bytes;
        }
    }
}

/// Checks a window that came inside a job. Jobs that come one after the other with the same one share it.
pub(super) fn inside(
    message: &generated::Window,
    received: &mut ReceivedWindows,
) -> Result<Arc<Window>, ProtocolError> {
    if let Some((last, window)) = &received.inside
        && is_same(last, message)
    {
        return Ok(Arc::clone(window));
    }
    let window = Arc::new(window::decode(message)?);
    received.inside = Some((message.clone(), Arc::clone(&window)));
    Ok(window)
}

/// Whether two windows are the same, bit by bit.
fn is_same(one: &generated::Window, other: &generated::Window) -> bool {
    let start = |window: &generated::Window| window.start.map(f64::to_bits);
    // The others are arrays of bytes.
    start(one) == start(other)
        && (&one.times, &one.observed, &one.since, &one.inputs)
            == (&other.times, &other.observed, &other.since, &other.inputs)
}

/// The name of a window, where it is large enough to travel under one.
pub(super) fn name(window: &generated::Window) -> Option<WindowId> {
    (window.encoded_len() > INLINE).then(|| digest(window))
}

/// The message that sends a window ahead of its jobs; nothing where the stream has it.
pub(super) fn ahead(
    id: &WindowId,
    window: &generated::Window,
    sent: &mut SentWindows,
) -> Option<generated::ToWorker> {
    if sent.get(id).is_some() {
        return None;
    }
    sent.keep(*id, window.encoded_len(), ());
    let message =
        generated::WindowMsg { id: bytes::Bytes::copy_from_slice(id), window: Some(window.clone()) };
    Some(generated::ToWorker { kind: Some(generated::to_worker::Kind::Window(message)) })
}

/// Checks a window that arrived ahead of its jobs, and keeps it.
pub(super) fn receive(
    message: &generated::WindowMsg,
    received: &mut ReceivedWindows,
) -> Result<(), ProtocolError> {
    let found = super::required(message.window.as_ref(), "window")?;
    let id = digest(found);
    if *message.id != id {
        let message = "does not hash to its name".to_owned();
        return Err(ProtocolError::Shape { field: "window", message });
    }
    received.keep(id, found.encoded_len(), Arc::new(window::decode(found)?));
    Ok(())
}

pub(super) fn digest(window: &generated::Window) -> WindowId {
    let mut hasher = blake3::Hasher::new();
    let mut add = |part: &[u8]| {
        // Lengths keep neighbouring arrays apart.
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part);
    };
    add(&window.start.map(f64::to_le_bytes).unwrap_or_default());
    add(&window.times);
    add(&window.observed);
    add(&window.since);
    for signal in &window.inputs {
        add(&signal.times);
        add(&signal.values);
    }
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(i: usize) -> WindowId {
        *blake3::hash(&i.to_le_bytes()).as_bytes()
    }

    #[test]
    fn both_ends_forget_the_windows_that_were_sent_first() {
        let mut windows = Windows::default();
        for i in 0..5 {
            windows.keep(id(i), KEPT / 4, i);
        }
        assert_eq!(windows.get(&id(0)), None, "a fifth quarter does not fit");
        assert_eq!((1..5).map(|i| windows.get(&id(i)).copied()).collect::<Vec<_>>(), [1, 2, 3, 4].map(Some));
        // Sent again it is the last one; known ones keep their place.
        windows.keep(id(1), KEPT / 4, 1);
        windows.keep(id(0), KEPT / 4, 0);
        assert_eq!(windows.get(&id(1)), None);
        assert_eq!(windows.bytes, KEPT);
    }

    #[test]
    fn jobs_with_the_same_window_share_it_and_those_with_another_zero_do_not() {
        let window =
            |start, observed| Window { start, times: vec![1.0], observed, inputs: vec![], since: vec![] };
        let mut received = ReceivedWindows::default();
        let mut take = |of: Window| inside(&window::encode(&of), &mut received).unwrap();
        let first = take(window(0.0, vec![f64::NAN]));
        assert!(
            Arc::ptr_eq(&first, &take(window(0.0, vec![f64::NAN]))),
            "equal bits, though no equal numbers"
        );
        assert!(take(window(-0.0, vec![f64::NAN])).start.is_sign_negative());
        assert!(take(window(-0.0, vec![-0.0])).observed[0].is_sign_negative());
        assert!(take(window(-0.0, vec![0.0])).observed[0].is_sign_positive());
    }

    #[test]
    fn a_window_larger_than_all_that_is_kept_is_kept_alone() {
        let mut windows = Windows::default();
        windows.keep(id(0), 10, ());
        windows.keep(id(1), KEPT + 1, ());
        assert_eq!((windows.get(&id(0)), windows.get(&id(1))), (None, Some(&())));
        windows.keep(id(2), 10, ());
        assert_eq!((windows.get(&id(1)), windows.get(&id(2))), (None, Some(&())));
    }
}
