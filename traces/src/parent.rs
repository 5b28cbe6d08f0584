//! What belongs together, as it crosses between processes: `traceparent`, version 00.
//!
//! Next file to read: [`super::target`].

use std::fmt;
use std::str::FromStr;

use opentelemetry::trace::{SpanContext, SpanId, TraceFlags, TraceId, TraceState};

/// The span above those that are begun elsewhere: `00-<trace, 32 digits>-<span, 16 digits>-<flags, 2 digits>`, lower-case hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TraceParent(SpanContext);

impl TraceParent {
    pub(crate) fn of(context: SpanContext) -> Self {
        Self(context)
    }

    pub(crate) fn context(&self) -> &SpanContext {
        &self.0
    }
}

impl fmt::Display for TraceParent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(context) = self;
        write!(f, "00-{}-{}-{:02x}", context.trace_id(), context.span_id(), context.trace_flags().to_u8())
    }
}

impl FromStr for TraceParent {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let parts = text.split('-').collect::<Vec<_>>();
        let lengths = parts.iter().map(|part| part.len()).collect::<Vec<_>>();
        let is_lower_hex = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        let well_formed =
            lengths == [2, 32, 16, 2] && parts.iter().all(|part| part.bytes().all(is_lower_hex));
        let [version, trace, span, flags] = parts[..] else { return Err(()) };
        if !well_formed || version != "00" {
            return Err(());
        }
        let trace = TraceId::from_hex(trace).map_err(drop)?;
        let span = SpanId::from_hex(span).map_err(drop)?;
        let flags = TraceFlags::new(u8::from_str_radix(flags, 16).map_err(drop)?);
        let context = SpanContext::new(trace, span, flags, true, TraceState::default());
        if context.is_valid() { Ok(Self(context)) } else { Err(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_recommendation_shows_is_read_and_written_and_what_it_forbids_is_not() {
        // Example of section 3.2.2.5 of the recommendation.
        let text = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
        let parent: TraceParent = text.parse().expect("it is well-formed");
        assert_eq!(parent.to_string(), text);
        for wrong in [
            "",
            "00",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
            "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e473-00f067aa0ba902b77-01",
        ] {
            assert_eq!(wrong.parse::<TraceParent>(), Err(()), "{wrong}");
        }
    }
}
