//! A UM-Bridge server with the model that is asked for: started here, or by somebody else.
//!
//! Next file to read: [`super::client`].

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use starlings_models::{SolverDef, meant, nearest};

use super::client::{Client, Trouble};
use crate::SolverError;
use crate::error::tail_text;
use crate::machine::free_port;
use crate::process::{Launch, Process, ending, is_killed};
use crate::site::Site;

/// Variable by which servers learn where to listen.
const PORT: &str = "PORT";
/// Where a server listens that is started here and has no address in the study.
const HERE: &str = "http://127.0.0.1:{port}";
/// How often a server that starts is asked whether it is ready.
const LOOK: Duration = Duration::from_millis(10);
/// Least time for a question but the first: a busy machine may take some of it.
const QUESTION: Duration = Duration::from_millis(100);
/// How long a server that broke its connection may take to end, so that its ending can be told.
const LAST_WORDS: Duration = Duration::from_secs(5);

/// A server that answers, with one of its models.
pub(super) struct Server {
    pub(super) client: Client,
    pub(super) model: String,
    /// Lengths of the vectors that the model takes.
    pub(super) input_sizes: Vec<usize>,
    process: Mutex<Option<Process>>,
    /// Whether the program that was started here was ended here.
    is_over: AtomicBool,
}

impl Server {
    /// Starts the server on these cores, where the study has a command for it, and waits until it answers.
    ///
    /// # Errors
    /// When it cannot be started, does not answer in time, or lacks the model.
    pub(super) fn start(
        def: &SolverDef,
        site: &Site,
        cores: Option<Vec<usize>>,
    ) -> Result<Self, SolverError> {
        let address = def.address.as_deref().unwrap_or(HERE);
        let port = if address.contains("{port}") { port()? } else { String::new() };
        let filled = |text: &str| text.replace("{port}", &port);
        let client = Client::new(url(&filled(address))?);
        let mut process = None;
        if !def.command.is_empty() {
            let command: Vec<String> = def.command.iter().map(|argument| filled(argument)).collect();
            let mut environment = def.environment.clone();
            if !port.is_empty() {
                environment.entry(PORT.to_owned()).or_insert_with(|| port.clone());
            }
            let launch = Launch {
                command: &command,
                base: &def.folder,
                folder: None,
                environment,
                threads: def.threads,
                cores,
                memory: def.memory,
                input: false,
            };
            process = Some(site.start(&launch)?);
        }
        if let Some(process) = &mut process {
            process.remember_output();
        }
        let patience = Duration::try_from_secs_f64(def.start_timeout).unwrap_or(Duration::MAX);
        let started = def.command.first().map(String::as_str).zip(process.as_mut());
        let info = ready(&client, started, patience)?;
        let wrong = |message: String| SolverError::Description { program: client.url().to_owned(), message };
        let model = model(def.model.as_deref(), &info).map_err(wrong)?;
        let trouble = |trouble: Trouble| wrong(format!("the model `{model}` {trouble}"));
        let about = client.ask("/ModelInfo", &json!({ "name": model }), patience).map_err(trouble)?;
        if about["support"]["Evaluate"] == false {
            return Err(wrong(format!("the model `{model}` does not support Evaluate")));
        }
        let input_sizes = client.sizes("/InputSizes", "inputSizes", &model, patience).map_err(trouble)?;
        let (process, is_over) = (Mutex::new(process), AtomicBool::new(false));
        Ok(Self { client, model, input_sizes, process, is_over })
    }

    /// The model and where it is, for messages.
    pub(super) fn name(&self) -> String {
        format!("the model `{}` at {}", self.model, self.client.url())
    }

    /// Whether the program that was started here has ended.
    pub(super) fn has_ended(&self) -> bool {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        self.is_over.load(Ordering::Acquire)
            || process.as_mut().is_some_and(|process| process.ended().is_some())
    }

    /// Whether somebody stopped the program that was started here.
    pub(super) fn is_stopped(&self) -> bool {
        let process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        process.as_ref().is_some_and(Process::is_stopped)
    }

    /// How the program ended after a connection broke: whether somebody killed it, and in words with the end of its output.
    /// A run that lost its server because another slot ended it lost it to a kill. None for a server of somebody else, or one
    /// that still runs.
    pub(super) fn ending(&self) -> Option<(bool, String)> {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_over.load(Ordering::Acquire) {
            return Some((true, "its program was ended for another run".to_owned()));
        }
        let process = process.as_mut()?;
        let status = process.wait(LAST_WORDS)?;
        let text = format!("its program {}{}", ending(status), tail_text(&process.tail()));
        Some((is_killed(status), text))
    }

    /// The end of what the program said, as the end of a sentence.
    pub(super) fn tail(&self) -> String {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        process.as_mut().map(|process| tail_text(&process.tail())).unwrap_or_default()
    }

    /// Ends the program that was started here, with whatever it is doing.
    pub(super) fn end(&self) {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        if process.take().is_some() {
            self.is_over.store(true, Ordering::Release);
        }
    }
}

fn port() -> Result<String, SolverError> {
    let unknown = |error| SolverError::Incomplete(format!("no port for the solver: {error}"));
    free_port().map(|port| port.to_string()).map_err(unknown)
}

/// The address as the start of every question.
fn url(address: &str) -> Result<String, SolverError> {
    let address = address.trim_end_matches('/');
    match address.split_once("://") {
        None => Ok(format!("http://{address}")),
        Some(("http", _)) => Ok(address.to_owned()),
        Some(_) => {
            let message =
                format!("`{address}` is no address of a UM-Bridge server: expected http://host:port");
            Err(SolverError::Incomplete(message))
        }
    }
}

/// Asks until the server answers, its program has ended, or time is up.
fn ready(
    client: &Client,
    mut started: Option<(&str, &mut Process)>,
    patience: Duration,
) -> Result<Value, SolverError> {
    let since = Instant::now();
    let program = client.url().to_owned();
    // The first question may take all the time there is; later ones what is left.
    let mut left = patience.max(QUESTION);
    loop {
        let trouble = match client.info(left) {
            Ok(info) => return Ok(info),
            Err(trouble) => trouble,
        };
        if let Some((program, process)) = &mut started
            && let Some(status) = process.ended()
        {
            let (program, tail) = ((*program).to_owned(), process.tail());
            let what = format!("{} before it was ready", ending(status));
            return Err(SolverError::NotReady { program, what, tail, killed: is_killed(status) });
        }
        std::thread::sleep(LOOK);
        left = patience.saturating_sub(since.elapsed());
        // A question with too little time would only be told as one without answer.
        if left < QUESTION {
            let tail = started.map(|(_, process)| process.tail()).unwrap_or_default();
            let seconds = patience.as_secs_f64();
            let what = format!(
                "was not ready within {seconds} s: it {trouble}; a server that is started here finds its port in {PORT}, or as \
                 {{port}} in its command"
            );
            return Err(SolverError::NotReady { program, what, tail, killed: false });
        }
    }
}

/// The model of that name, or the only one.
fn model(wanted: Option<&str>, info: &Value) -> Result<String, String> {
    let version = info["protocolVersion"].as_f64();
    if !version.is_some_and(|version| (1.0..2.0).contains(&version)) {
        let version = &info["protocolVersion"];
        return Err(format!("it speaks UM-Bridge {version}, and 1.0 is spoken here"));
    }
    let models = info["models"].as_array().into_iter().flatten();
    let models: Vec<String> = models.filter_map(|name| name.as_str().map(str::to_owned)).collect();
    let known = models.join(", ");
    match (wanted, models.as_slice()) {
        (Some(wanted), models) if models.iter().any(|name| name == wanted) => Ok(wanted.to_owned()),
        (Some(wanted), models) => {
            let near = meant(nearest(wanted, models));
            Err(format!("it has no model `{wanted}`; it has {known}{near}"))
        }
        (None, [only]) => Ok(only.clone()),
        (None, []) => Err("it has no model".to_owned()),
        (None, _) => Err(format!("it has several models, {known}: say which by `model`")),
    }
}
