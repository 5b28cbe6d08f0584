//! What the end-to-end tests share: the binary, run folders, a study on a real recording.

#![allow(dead_code)] // every test file uses its own part

pub(crate) mod python;
pub(crate) mod studies;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rusqlite::Connection;

/// The longest any single wait of a test may take.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

/// The binary under test.
pub(crate) fn starlings() -> Command {
    Command::new(env!("CARGO_BIN_EXE_starlings"))
}

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Runs a command to its end: exit code, standard output, standard error.
pub(crate) fn output(command: &mut Command) -> (i32, String, String) {
    let out = command.stdin(Stdio::null()).output().expect("the binary starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (out.status.code().unwrap_or(-1), text(out.stdout), text(out.stderr))
}

/// Expects a command to be refused with exit code 2, nothing on standard output and every one of `words`.
pub(crate) fn refused(command: &mut Command, words: &[&str]) {
    let (code, stdout, stderr) = output(command);
    // Line breaks of the display may fall anywhere.
    let flat =
        stderr.split_whitespace().filter(|w| !matches!(*w, "│" | "×" | "╰─▶")).collect::<Vec<_>>().join(" ");
    assert_eq!(code, 2, "{stderr}");
    assert_eq!(stdout, "");
    for word in words {
        assert!(flat.contains(word), "no `{word}` in: {flat}");
    }
}

/// Runs a study into `out` with local workers and returns its summary.
pub(crate) fn run(study: &Path, out: &Path, workers: usize) -> serde_json::Value {
    let mut command = starlings();
    command.arg("run").arg(study).arg("--out").arg(out).args(["--workers", &workers.to_string(), "--json"]);
    let (code, stdout, stderr) = output(&mut command);
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

/// Polls until `ready` holds; fails the test after [`LIMIT`].
pub(crate) fn wait_until(what: &str, mut ready: impl FnMut() -> bool) {
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < LIMIT, "waited too long for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Analyses stored so far in a run folder; zero while there is no database.
pub(crate) fn analyses(out: &Path) -> i64 {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    Connection::open_with_flags(out.join("run.db"), flags)
        .and_then(|db| db.query_row("SELECT count(*) FROM analyses", [], |row| row.get(0)))
        .unwrap_or(0)
}

/// Kills a process at once, as `kill -9` does.
pub(crate) fn kill(child: &mut Child) {
    child.kill().expect("SIGKILL");
    child.wait().expect("reaped");
}

/// The bytes of a result file.
pub(crate) fn bytes(out: &Path, name: &str) -> Vec<u8> {
    std::fs::read(out.join(name)).unwrap_or_else(|e| panic!("{}: {e}", out.join(name).display()))
}
