//! Questions to a UM-Bridge server and what can go wrong with them.
//!
//! Protocol 1.0: JSON over HTTP (L. Seelinger et al., UM-Bridge: uncertainty quantification and modeling bridge, Journal of
//! Open Source Software 8, 4748, 2023). Next file to read: [`super::server`].

use std::time::Duration;

use serde_json::{Value, json};
use ureq::Agent;

use super::super::command::json::document;

/// How long an idle connection is used again: many servers close theirs after five seconds.
const IDLE: Duration = Duration::from_secs(4);
/// Longest answer, bytes.
const LONGEST: u64 = 1 << 30;
/// Letters of an answer that a message shows.
const SHOWN: usize = 300;

/// Why a question has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum Trouble {
    #[error("did not answer {path} within {seconds} s")]
    Silent { path: String, seconds: f64 },
    #[error("cannot be reached for {path}: {reason}")]
    Connection { path: String, reason: String },
    #[error("answered {path} with an error: {0}", path = .1)]
    Said(String, String),
    #[error("answered {path} with what is no UM-Bridge: {reason}")]
    Garbage { path: String, reason: String },
}

/// The way to a server.
#[derive(Clone, Debug)]
pub(super) struct Client {
    agent: Agent,
    url: String,
}

impl Client {
    pub(super) fn new(url: String) -> Self {
        let config = Agent::config_builder().http_status_as_error(false).max_idle_age(IDLE).proxy(None);
        Self { agent: config.build().into(), url }
    }

    pub(super) fn url(&self) -> &str {
        &self.url
    }

    /// What the server says of itself.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) fn info(&self, patience: Duration) -> Result<Value, Trouble> {
        let path = "/Info";
        let request = self.agent.get(format!("{}{path}", self.url)).config().timeout_global(Some(patience));
        let response = request.build().call();
        answer(path, patience, response)
    }

    /// Asks one question about a model.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) fn ask(&self, path: &str, body: &Value, patience: Duration) -> Result<Value, Trouble> {
        let request = self.agent.post(format!("{}{path}", self.url)).config().timeout_global(Some(patience));
        let response = request.build().send_json(body);
        answer(path, patience, response)
    }

    /// Lengths of the vectors that a model takes or gives.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) fn sizes(
        &self,
        path: &str,
        key: &str,
        model: &str,
        patience: Duration,
    ) -> Result<Vec<usize>, Trouble> {
        let answer = self.ask(path, &json!({ "name": model, "config": {} }), patience)?;
        let sizes = answer[key].as_array().and_then(|list| {
            list.iter().map(|size| size.as_u64().map(|size| size as usize)).collect::<Option<Vec<_>>>()
        });
        let reason = || format!("no list `{key}` in {}", short(&answer.to_string()));
        sizes.ok_or_else(|| Trouble::Garbage { path: path.to_owned(), reason: reason() })
    }
}

fn answer(
    path: &str,
    patience: Duration,
    response: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
) -> Result<Value, Trouble> {
    let path = path.to_owned();
    let seconds = patience.as_secs_f64();
    let trouble = |error: ureq::Error| match error {
        ureq::Error::Timeout(_) => Trouble::Silent { path: path.clone(), seconds },
        other => Trouble::Connection { path: path.clone(), reason: other.to_string() },
    };
    let mut response = response.map_err(&trouble)?;
    let body = response.body_mut().with_config().limit(LONGEST).lossy_utf8(true).read_to_string();
    let text = body.map_err(&trouble)?;
    let status = response.status();
    let read = document(&text);
    if let Some(error) = read.as_ref().ok().and_then(|answer| answer.get("error")) {
        let part = |key: &str| error[key].as_str().unwrap_or_default();
        let said = match (part("type"), part("message")) {
            ("", "") => short(&error.to_string()),
            (kind, "") => kind.to_owned(),
            ("", message) => message.to_owned(),
            (kind, message) => format!("{kind}: {message}"),
        };
        return Err(Trouble::Said(said, path));
    }
    if !status.is_success() {
        return Err(Trouble::Said(format!("status {status}, {}", short(&text)), path));
    }
    read.map_err(|error| Trouble::Garbage { path, reason: format!("{error} in {}", short(&text)) })
}

fn short(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.is_empty() { "nothing".to_owned() } else { line.chars().take(SHOWN).collect() }
}
