//! A run that serves metrics, and a real Prometheus that scrapes it.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::common::{LIMIT, starlings, studies, wait_until};

/// Records of the study: each is a run of about a tenth of a second for every sigma point of every pass, and no run is made before
/// the test starts a worker.
const RECORDS: usize = 40;

/// A coordinator at work; it ends with the test.
pub(crate) struct Coordinator {
    child: Child,
    workers: Vec<Child>,
    access: PathBuf,
    /// Where its metrics are.
    pub(crate) metrics: SocketAddr,
}

impl Coordinator {
    /// Starts a run of many slow jobs, with metrics on a free port.
    pub(crate) fn start(folder: &Path) -> Self {
        let study = studies::slow(folder, RECORDS);
        let mut command = starlings();
        let access = folder.join("access.json");
        command.arg("run").arg(study).arg("--out").arg(folder.join("out")).args(["--listen", "127.0.0.1:0"]);
        command.arg("--access").arg(&access);
        let child = command
            .args(["--metrics", "0"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = child.spawn().expect("it starts");
        let says = child.stderr.take().expect("piped");
        let metrics = told(says, |line| line.strip_prefix("metrics at http://")?.strip_suffix("/metrics"));
        Self { child, workers: Vec::new(), access, metrics }
    }

    /// Starts a worker for it.
    pub(crate) fn worker(&mut self, slots: &str) {
        wait_until("the access file", || std::fs::metadata(&self.access).is_ok_and(|file| file.len() > 0));
        let mut command = starlings();
        command.args(["worker", "--slots", slots, "--access"]).arg(&self.access);
        let worker = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        self.workers.push(worker.expect("a worker"));
    }

    /// Its page.
    pub(crate) fn page(&self) -> String {
        let (code, page) = get(self.metrics, "/metrics");
        assert_eq!(code, 200, "{page}");
        page
    }

    /// One value of it.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        value(&self.page(), name)
    }
}

impl Drop for Coordinator {
    fn drop(&mut self) {
        for child in self.workers.iter_mut().chain([&mut self.child]) {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// A server of the distribution's package.
pub(crate) struct Prometheus {
    child: Child,
    api: SocketAddr,
}

impl Prometheus {
    /// Whether the program is installed.
    pub(crate) fn is_here() -> bool {
        Command::new("prometheus")
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok()
    }

    /// Starts one that scrapes `target` again and again.
    pub(crate) fn start(folder: &Path, target: SocketAddr) -> Self {
        let file = folder.join("prometheus.yml");
        let jobs = format!("[{{job_name: starlings, static_configs: [{{targets: ['{target}']}}]}}]");
        let text = format!("global: {{scrape_interval: 500ms}}\nscrape_configs: {jobs}\n");
        std::fs::write(&file, text).expect("written");
        let mut child = Command::new("prometheus")
            .arg(format!("--config.file={}", file.display()))
            .arg(format!("--storage.tsdb.path={}", folder.join("tsdb").display()))
            .arg("--web.listen-address=127.0.0.1:0")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let says = child.stderr.take().expect("piped");
        let api = told(says, |line| {
            let (_, rest) = line.split_once("msg=\"Listening on\" address=")?;
            rest.split_whitespace().next()
        });
        let prometheus = Self { child, api };
        wait_until("its readiness", || get(api, "/-/ready").0 == 200);
        prometheus
    }

    /// The answer of its API.
    pub(crate) fn get(&self, path: &str) -> String {
        get(self.api, path).1
    }

    /// The value of an instant query with one answer; `None` while it has none.
    pub(crate) fn query(&self, query: &str) -> Option<f64> {
        let encoded = query.bytes().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "%{byte:02X}");
            text
        });
        let answer = self.get(&format!("/api/v1/query?query={encoded}"));
        let answer: serde_json::Value =
            serde_json::from_str(&answer).unwrap_or_else(|e| panic!("{e}: {answer}"));
        assert_eq!(answer["status"], "success", "{query}: {answer}");
        let found = answer["data"]["result"].as_array().expect("a vector");
        assert!(found.len() <= 1, "{query}: {answer}");
        found.first().map(|one| one["value"][1].as_str().and_then(|v| v.parse().ok()).expect("a number"))
    }
}

impl Drop for Prometheus {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The value of a sample on a page.
pub(crate) fn value(page: &str, name: &str) -> Option<f64> {
    page.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.parse().ok())
}

/// Code and body of an answer over HTTP/1.0; 0 where nobody answers.
pub(crate) fn get(address: SocketAddr, path: &str) -> (u16, String) {
    let ask = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect(address)?;
        stream.set_read_timeout(Some(LIMIT))?;
        write!(stream, "GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    };
    let Ok(answer) = ask() else { return (0, String::new()) };
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_default();
    let code = head.split_whitespace().nth(1).and_then(|code| code.parse().ok());
    (code.unwrap_or(0), body.to_owned())
}

/// The address that a program tells on a line; what it says later is read and dropped, so that it never waits for a reader.
fn told(says: impl Read + Send + 'static, address: impl Fn(&str) -> Option<&str>) -> SocketAddr {
    let mut lines = BufReader::new(says).lines();
    let mut before = String::new();
    for line in lines.by_ref().map_while(Result::ok) {
        if let Some(found) = address(&line) {
            let found = found.parse().unwrap_or_else(|e| panic!("{e}: {line}"));
            std::thread::spawn(move || lines.map_while(Result::ok).count());
            return found;
        }
        before = before + &line + "\n";
    }
    panic!("it ended and told no address:\n{before}");
}
