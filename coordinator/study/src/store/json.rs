//! Plain data as the text under which the store keeps it.
//!
//! Next file to read: [`super::folder`].

use serde::Serialize;

/// The text; empty for what cannot be written, which does not occur for plain data.
pub(crate) fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
