//! Where spans go: a file, or a collector.
//!
//! Next file to read: [`super::export`].

use std::path::PathBuf;
use std::str::FromStr;

/// Where spans go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A file to which lines of OTLP in JSON are added; several processes may name the same one.
    File(PathBuf),
    /// A collector that takes OTLP over HTTP, in protobuf: where it takes spans, such as `http://localhost:4318/v1/traces`.
    Collector(String),
}

/// Why spans cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TracesError {
    /// It is neither a file nor a collector.
    #[error("{0}")]
    Target(String),
    /// The file cannot be opened.
    #[error("cannot write spans to {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
}

/// Where a collector takes spans, by the specification of OTLP over HTTP.
const PATH: &str = "/v1/traces";

impl FromStr for Target {
    type Err = TracesError;

    fn from_str(text: &str) -> Result<Self, TracesError> {
        if text.is_empty() {
            return Err(TracesError::Target(
                "expected a file or a URL such as http://localhost:4318".to_owned(),
            ));
        }
        if text.starts_with("https://") {
            let message = "a collector is reached over http:// (one that needs TLS: start a collector beside this program that passes \
                           spans on)";
            return Err(TracesError::Target(message.to_owned()));
        }
        let Some(rest) = text.strip_prefix("http://") else {
            return Ok(Self::File(PathBuf::from(text)));
        };
        let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
        if host.is_empty() {
            return Err(TracesError::Target(format!("{text} names no host: expected http://HOST:PORT")));
        }
        Ok(Self::Collector(if path.is_empty() { format!("http://{host}{PATH}") } else { text.to_owned() }))
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Collector(url) => f.write_str(url),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_is_a_collector_with_the_usual_path_and_everything_else_a_file() {
        let of = |text: &str| text.parse::<Target>().map_err(|error| error.to_string());
        assert_eq!(of("spans.jsonl"), Ok(Target::File("spans.jsonl".into())));
        let usual = Target::Collector("http://localhost:4318/v1/traces".to_owned());
        assert_eq!(of("http://localhost:4318"), Ok(usual.clone()));
        assert_eq!(of("http://localhost:4318/"), Ok(usual));
        let own = Target::Collector("http://host/own/path".to_owned());
        assert_eq!(of("http://host/own/path"), Ok(own));
        assert!(of("https://host").is_err_and(|says| says.contains("http://")));
        assert!(of("http://").is_err_and(|says| says.contains("names no host")));
        assert!(of("").is_err());
    }
}
