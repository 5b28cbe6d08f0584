//! Coordinators and workers of the binary that know each other by an access file.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::common::{LIMIT, starlings, wait_until};

/// A process that is killed when nobody keeps it, and what it says on standard error.
pub(crate) struct Started {
    pub(crate) child: Child,
    said: Arc<Mutex<String>>,
    reader: JoinHandle<()>,
}

/// How long what a process said in its last moment may be on its way; what it started may keep its stream open for longer.
const LAST_WORDS: Duration = Duration::from_secs(2);

impl Started {
    pub(crate) fn of(command: &mut Command) -> Self {
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let said = Arc::<Mutex<String>>::default();
        let (kept, stderr) = (Arc::clone(&said), child.stderr.take().unwrap());
        let reader = std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                kept.lock().unwrap().push_str(&(line + "\n"));
            }
        });
        Self { child, said, reader }
    }

    pub(crate) fn said(&self) -> String {
        self.said.lock().unwrap().clone()
    }

    pub(crate) fn await_words(&self, words: &str) {
        let start = Instant::now();
        while !self.said().contains(words) {
            assert!(start.elapsed() < LIMIT, "waited too long for `{words}` in:\n{}", self.said());
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Its exit code, when all that it said has been read.
    pub(crate) fn end(&mut self) -> Option<i32> {
        wait_until("the end of a process", || self.child.try_wait().unwrap().is_some());
        let ended = Instant::now();
        while !self.reader.is_finished() && ended.elapsed() < LAST_WORDS {
            std::thread::sleep(Duration::from_millis(2));
        }
        self.child.wait().unwrap().code()
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A command that waits for workers on a free port of loopback.
pub(crate) fn listening(command: &str, study: &Path, options: &[&str]) -> Started {
    let mut call = starlings();
    call.arg(command).arg(study).args(["--listen", "127.0.0.1:0"]).args(options);
    let started = Started::of(&mut call);
    started.await_words("listening on ");
    started
}

/// A worker with one slot that has an access file.
pub(crate) fn worker(access: &Path, options: &[&str]) -> Started {
    Started::of(starlings().args(["worker", "--slots", "1", "--access"]).arg(access).args(options))
}

/// The value of a key of an access file.
pub(crate) fn value(access: &Path, key: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(access).unwrap();
    serde_json::from_str::<serde_json::Value>(&text).unwrap()[key].clone()
}

pub(crate) fn token(access: &Path) -> String {
    value(access, "token").as_str().unwrap().to_owned()
}

/// Where the coordinator of an access file listens.
pub(crate) fn address(access: &Path) -> String {
    value(access, "addresses")[0].as_str().unwrap().to_owned()
}

/// Both parts of the access file of a run folder.
pub(crate) fn parts(out: &Path) -> [PathBuf; 2] {
    ["access.json", "access.key"].map(|name| out.join(name))
}
