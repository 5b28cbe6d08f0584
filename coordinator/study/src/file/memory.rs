//! Amounts of memory, such as `2 GiB`.
//!
//! Next file to read: [`super::solver`].

use toml::Spanned;

use super::table::{Node, number, wrong_type};
use crate::problem::Source;

/// Bytes of a text such as `2 GiB`.
pub fn bytes_of(words: &str) -> Option<f64> {
    const UNITS: [(&str, f64); 9] = [
        ("B", 1.0),
        ("kB", 1e3),
        ("MB", 1e6),
        ("GB", 1e9),
        ("TB", 1e12),
        ("KiB", 1024.0),
        ("MiB", 1_048_576.0),
        ("GiB", 1_073_741_824.0),
        ("TiB", 1_099_511_627_776.0),
    ];
    let split = words.find(|c: char| c.is_alphabetic()).unwrap_or(words.len());
    let (value, unit) = (words[..split].trim(), words[split..].trim());
    let factor = UNITS.iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)).map(|(_, factor)| factor);
    value.parse::<f64>().ok().zip(factor).map(|(value, factor)| value * factor)
}

/// Bytes, or a text such as `2 GiB`.
pub(super) fn memory(source: &Source, node: &Node<'_>) -> Option<u64> {
    let bytes = if let Some(words) = node.get_ref().as_str() {
        bytes_of(words)
    } else if node.get_ref().is_integer() || node.get_ref().is_float() {
        number(source, node, "`memory`").map(Spanned::into_inner)
    } else {
        None
    };
    match bytes {
        // Less is too little for any program, more is beyond any machine.
        Some(bytes) if (1e6..1e18).contains(&bytes) => Some(bytes as u64),
        Some(bytes) if bytes.is_finite() => {
            let message = format!("`memory` must be at least 1 MB, found {bytes} bytes");
            source.report_with(node.span(), message, "such as `memory = \"2 GiB\"`");
            None
        }
        _ => {
            wrong_type(source, node, "`memory`", "bytes, or a text such as \"2 GiB\"");
            None
        }
    }
}
