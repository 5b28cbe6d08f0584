//! What can be wrong with what a program wrote; every sentence names the file and what to look at.
//!
//! Next file to read: [`super::results`].

use starlings_models::meant;

/// Why an output cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum Fault {
    #[error("the program wrote no file `{file}`{}{}; does the rule name the right file?", listed(", only ", known), meant(nearest.as_ref()))]
    NoFile { file: String, nearest: Option<String>, known: Vec<String> },
    #[error("{file} cannot be read: {reason}")]
    Unreadable { file: String, reason: String },
    #[error(
        "{file} is longer than {limit} MiB, of which the rest is dropped: have the program write it to a file"
    )]
    TooLong { file: String, limit: usize },
    #[error("{file} has no column `{column}`{}{}", listed("; it has ", known), meant(nearest.as_ref()))]
    NoColumn { file: String, column: String, nearest: Option<String>, known: Vec<String> },
    #[error("{file} is not JSON: {reason}")]
    NotJson { file: String, reason: String },
    #[error("{file} has no key `{key}`{}{}", listed("; it has ", known), meant(nearest.as_ref()))]
    NoKey { file: String, key: String, nearest: Option<String>, known: Vec<String> },
    #[error("{file} has {got} value{} where {expected} belong{}: {shape}", plural(*got), if *expected == 1 { "s" } else { "" })]
    Length { file: String, expected: usize, got: usize, shape: String },
    #[error("`{text}` at {place} of {file} is not a number")]
    NotNumber { file: String, place: String, text: String },
    #[error("the times in column `{column}` of {file} do not increase: {after} after {before}")]
    Times { file: String, column: String, before: f64, after: f64 },
    #[error("{file} covers the times {first} to {last}, and t = {time} is asked for")]
    Uncovered { file: String, first: f64, last: f64, time: f64 },
}

/// How many values belong to an output, in words.
pub(super) fn shape(size: usize, n_times: usize) -> String {
    match (size, n_times) {
        (1, 1) => "one for the one time of the run".to_owned(),
        (1, n) => format!("one for each of the {n} times of the run"),
        (s, 1) => format!("{s} for the one time of the run"),
        (s, n) => format!("{s} for each of the {n} times of the run"),
    }
}

fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}

/// Names that a message lists.
const LISTED: usize = 12;

fn listed(lead: &str, names: &[String]) -> String {
    if names.is_empty() {
        return String::new();
    }
    let shown = names.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more =
        if names.len() > LISTED { format!(" and {} more", names.len() - LISTED) } else { String::new() };
    format!("{lead}{shown}{more}")
}
