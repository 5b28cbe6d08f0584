//! What errors, closed streams and panics say, for messages that people read.

use std::any::Any;
use std::error::Error;

/// The error and its causes; the outermost alone often only says that there was a transport error.
pub fn causes(error: &dyn Error) -> String {
    with_causes(error.to_string(), error.source())
}

/// What a closed stream says: its message and the causes beneath. The status code alone is mostly "Unknown error".
pub fn status_text(status: &tonic::Status) -> String {
    let text =
        if status.message().is_empty() { status.code().to_string() } else { status.message().to_owned() };
    with_causes(text, status.source())
}

/// What a panicking model said.
pub fn panic_text(panic: &(dyn Any + Send)) -> String {
    format!("the model panicked: {}", panic_words(panic))
}

/// The words of a panic.
pub fn panic_words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("without a message")
}

fn with_causes(mut text: String, mut source: Option<&(dyn Error + 'static)>) -> String {
    while let Some(cause) = source {
        // A status among the causes prints its code and its own causes once more.
        let words = match cause.downcast_ref::<tonic::Status>() {
            Some(status) => status.message().to_owned(),
            None => cause.to_string(),
        };
        // A wrapper that only repeats what it wraps says nothing; what it wraps comes next.
        let wraps = cause.source().is_some_and(|inner| inner.to_string() == words);
        if !wraps && !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_names_its_cause_and_not_only_its_code() {
        let cause = std::io::Error::other("cable pulled");
        let mut status = tonic::Status::unknown("h2 protocol error");
        status.set_source(std::sync::Arc::new(cause));
        assert_eq!(status_text(&status), "h2 protocol error: cable pulled");
        assert_eq!(status_text(&tonic::Status::unavailable("")), tonic::Code::Unavailable.to_string());
    }
}
