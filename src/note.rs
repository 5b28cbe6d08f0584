//! What is for people only, on standard error. Next file to read: [`crate::console`], for what programs read as well.

use std::fmt::Display;
use std::io::{self, Write};

use crate::log;
use crate::plain::Plain;

/// Writes a line to standard error; when nobody reads it, the work goes on.
pub(crate) fn note(content: impl Display) {
    if log::is_json() {
        return tracing::info!("{content}");
    }
    drawn(Plain(content));
}

/// The same for why a command ended without doing what was asked.
pub(crate) fn note_error(content: impl Display) {
    if log::is_json() {
        return tracing::error!("{content}");
    }
    drawn(Plain(format_args!("error: {content}")));
}

/// The same for a text that holds colours of our own, and nothing from outside that a terminal would obey.
pub(crate) fn drawn(content: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{content}");
}
