//! A run with a live page, and somebody who looks at it over a socket.

#![allow(dead_code)] // every test file uses its own part

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};

use rusqlite::Connection;
use serde_json::Value;

use crate::common::{LIMIT, starlings};

/// A command at work; it ends with the test.
pub(crate) struct Run {
    child: Child,
    /// `http://HOST:PORT/TOKEN/`
    pub(crate) url: String,
}

impl Run {
    /// Starts `starlings run` with a page.
    pub(crate) fn start(study: &Path, out: &Path, more: &[&str]) -> Self {
        Self::command("run", study, Some(out), more)
    }

    /// Starts a command with a page.
    pub(crate) fn command(name: &str, study: &Path, out: Option<&Path>, more: &[&str]) -> Self {
        let mut command = starlings();
        command.arg(name).arg(study).arg("--dashboard").args(more);
        if let Some(out) = out {
            command.arg("--out").arg(out);
        }
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
        let mut run = Self { child: child.expect("it starts"), url: String::new() };
        let says = run.child.stderr.take().expect("piped");
        let mut lines = BufReader::new(says).lines().map_while(Result::ok);
        let mut before = String::new();
        for line in lines.by_ref() {
            if let Some(url) = line.strip_prefix("live page at ") {
                url.clone_into(&mut run.url);
                break;
            }
            before = before + &line + "\n";
        }
        assert!(!run.url.is_empty(), "it ended and told no address:\n{before}");
        // It never waits for a reader.
        std::thread::spawn(move || lines.count());
        run
    }

    /// Where it is.
    pub(crate) fn address(&self) -> SocketAddr {
        self.url.split('/').nth(2).and_then(|at| at.parse().ok()).expect("an address")
    }

    /// What opens it.
    pub(crate) fn token(&self) -> &str {
        self.url.split('/').nth(3).expect("a token")
    }

    /// Code, head and body of a part of the page.
    pub(crate) fn get(&self, part: &str) -> (u16, String, String) {
        get(self.address(), &format!("/{}/{part}", self.token()))
    }

    /// A connection that has asked for a part of the page.
    pub(crate) fn ask(&self, part: &str) -> TcpStream {
        ask(self.address(), &format!("/{}/{part}", self.token())).expect("it answers")
    }

    /// Its stream of views.
    pub(crate) fn stream(&self) -> Stream {
        let lines = BufReader::new(self.ask("stream"));
        Stream { lines, points: Vec::new(), count: 0 }
    }

    /// Waits for its end, which is a good one.
    pub(crate) fn succeeds(&mut self) {
        let status = self.child.wait().expect("its end");
        assert!(status.success(), "{status}");
    }

    /// Whether it is over.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_some()
    }

    /// Asks it to break off, as Ctrl-C does.
    pub(crate) fn interrupt(&self) {
        signal(self.child.id(), rustix::process::Signal::INT);
    }

    /// Ends it at once.
    pub(crate) fn kill(&mut self) {
        crate::common::kill(&mut self.child);
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Views as they come.
pub(crate) struct Stream {
    lines: BufReader<TcpStream>,
    points: Vec<Value>,
    count: usize,
}

impl Stream {
    /// The first view that has what is looked for.
    pub(crate) fn find<T>(&mut self, what: &str, look: impl Fn(&Value) -> Option<T>) -> T {
        let found = self.by_ref().find_map(|sent| look(&sent));
        found.unwrap_or_else(|| panic!("the stream ended without {what}"))
    }

    /// The last view.
    pub(crate) fn last_view(&mut self) -> Value {
        self.by_ref().last().expect("a view")
    }

    /// Points of the course.
    pub(crate) fn points(&self) -> &[Value] {
        &self.points
    }

    /// Views so far.
    pub(crate) fn n_view(&self) -> usize {
        self.count
    }
}

impl Iterator for Stream {
    type Item = Value;

    fn next(&mut self) -> Option<Value> {
        loop {
            let mut line = String::new();
            if self.lines.read_line(&mut line).expect("a line in time") == 0 {
                return None;
            }
            let Some(text) = line.strip_prefix("data: ") else { continue };
            let sent: Value = serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"));
            self.points.truncate(sent["from"].as_u64().expect("a number") as usize);
            self.points.extend(sent["points"].as_array().expect("a list").iter().cloned());
            self.count += 1;
            return Some(sent);
        }
    }
}

/// What a view says of the store: analyses, the last pass and step, NIS with its observations, and every parameter with its band.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct View {
    pub(crate) analyses: u64,
    pub(crate) at: Option<(u64, u64)>,
    pub(crate) nis: Option<(f64, u64)>,
    pub(crate) parameters: Vec<(String, [f64; 3])>,
}

/// That part of a view.
pub(crate) fn of(view: &Value) -> View {
    let number = |value: &Value| value.as_f64().expect("a number");
    let parameter = |p: &Value| {
        let name = p["name"].as_str().expect("a name").to_owned();
        (name, [number(&p["estimate"]), number(&p["lo"]), number(&p["hi"])])
    };
    let pair = |value: &Value| Some((value.get(0)?.as_f64()?, value.get(1)?.as_u64()?));
    View {
        analyses: view["analyses"].as_u64().expect("a number"),
        at: pair(&view["at"]).map(|(pass, step)| (pass as u64, step)),
        nis: pair(&view["nis"]),
        parameters: view["parameters"].as_array().expect("a list").iter().map(parameter).collect(),
    }
}

/// The same from the store of a finished run.
pub(crate) fn stored(out: &Path) -> View {
    let db = Connection::open_with_flags(out.join("run.db"), rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY);
    let db = db.expect("a store");
    let last = "SELECT pass, step, nis, n_used, (SELECT count(*) FROM analyses) FROM analyses ORDER BY pass DESC, step DESC LIMIT 1";
    let (pass, step, nis, n_used, analyses) = db
        .query_row(last, [], |row| {
            Ok((row.get::<_, u64>(0)?, row.get::<_, u64>(1)?, row.get(2)?, row.get(3)?, row.get(4)?))
        })
        .expect("an analysis");
    let of_last =
        "SELECT parameter, estimate, lo, hi FROM estimates WHERE pass = ?1 AND step = ?2 ORDER BY rowid";
    let mut select = db.prepare(of_last).expect("a query");
    let rows =
        select.query_map([pass, step], |row| Ok((row.get(0)?, [row.get(1)?, row.get(2)?, row.get(3)?])));
    let parameters = rows.expect("rows").collect::<Result<_, _>>().expect("estimates");
    View { analyses, at: Some((pass, step + 1)), nis: Some((nis, n_used)), parameters }
}

/// The number of a worker's process, by the name that the run gives it.
pub(crate) fn pid_of(worker: &str) -> u32 {
    worker.rsplit('/').next().and_then(|pid| pid.parse().ok()).unwrap_or_else(|| panic!("{worker}"))
}

/// Ends a process at once.
pub(crate) fn kill(pid: u32) {
    signal(pid, rustix::process::Signal::KILL);
}

fn signal(pid: u32, signal: rustix::process::Signal) {
    let pid = rustix::process::Pid::from_raw(pid.cast_signed()).expect("a process");
    rustix::process::kill_process(pid, signal).expect("it is there");
}

/// Code, head and body of an answer over HTTP/1.0.
pub(crate) fn get(address: SocketAddr, path: &str) -> (u16, String, String) {
    let mut answer = String::new();
    ask(address, path).and_then(|mut stream| stream.read_to_string(&mut answer)).expect("an answer");
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_default();
    let code = head.split_whitespace().nth(1).and_then(|code| code.parse().ok());
    (code.unwrap_or(0), head.to_owned(), body.to_owned())
}

fn ask(address: SocketAddr, path: &str) -> std::io::Result<TcpStream> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(LIMIT))?;
    write!(stream, "GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n")?;
    Ok(stream)
}
