//! One window, both ways.
//!
//! Next file to read: [`super::windows`].

use starlings_models::{Signal, Window};

use super::{ProtocolError, floats, required};
use crate::generated;

/// A window as it travels.
pub(super) fn encode(window: &Window) -> generated::Window {
    generated::Window {
        start: Some(window.start),
        times: floats::encode(&window.times),
        observed: floats::encode(&window.observed),
        inputs: window
            .inputs
            .iter()
            .map(|s| generated::Signal { times: floats::encode(&s.times), values: floats::encode(&s.values) })
            .collect(),
        since: floats::encode(&window.since),
    }
}

/// A window that arrived.
pub(super) fn decode(window: &generated::Window) -> Result<Window, ProtocolError> {
    let times = floats::decode(&window.times, "times")?;
    let observed = floats::decode(&window.observed, "observed")?;
    let inputs = window.inputs.iter().map(decode_signal).collect::<Result<_, _>>()?;
    let since = floats::decode(&window.since, "since")?;
    let window = Window { start: required(window.start, "start")?, times, observed, inputs, since };
    check(&window)?;
    Ok(window)
}

/// Whether the arrays of a window fit together.
pub(super) fn check(window: &Window) -> Result<(), ProtocolError> {
    let Window { times, observed, inputs, since, .. } = window;
    if times.is_empty() {
        return Err(ProtocolError::Shape {
            field: "times",
            message: "a window needs at least one".to_owned(),
        });
    }
    if observed.len() % times.len() != 0 {
        let message = format!("{} values for {} times", observed.len(), times.len());
        return Err(ProtocolError::Shape { field: "observed", message });
    }
    if !(since.is_empty() || since.len() * times.len() == observed.len()) {
        let message = format!("{} values for {} rows", since.len(), observed.len() / times.len());
        return Err(ProtocolError::Shape { field: "since", message });
    }
    if let Some(signal) = inputs.iter().find(|signal| signal.times.len() != signal.values.len()) {
        let message = format!("{} values for {} times", signal.values.len(), signal.times.len());
        return Err(ProtocolError::Shape { field: "input", message });
    }
    Ok(())
}

fn decode_signal(signal: &generated::Signal) -> Result<Signal, ProtocolError> {
    let times = floats::decode(&signal.times, "input times")?;
    let values = floats::decode(&signal.values, "input values")?;
    Ok(Signal { times, values })
}
