//! A process that ends the solvers which a dead worker leaves behind.
//!
//! The worker holds the writing end of the guard's standard input. A line `+N` puts a process group under guard, `-N` takes it
//! out, `*MARK` says how the marks of programs begin that left their group; `+/folder` and `-/folder` do so with a folder that the worker made, and `=/folder/inner` says that a folder in it stays.
//! When the input ends, however the worker died, every group still under guard is killed and every folder removed. Next files
//! to read: [`super::process`], [`super::clear`].

use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

use rustix::process::{Pid, Signal, kill_process_group};

use super::clear::clear;
use super::orphans;

/// The guard of this process.
pub(crate) struct Guard {
    input: Arc<Mutex<ChildStdin>>,
}

impl Guard {
    pub(crate) fn start(program: &Path, arguments: &[String]) -> io::Result<Self> {
        let mut command = Command::new(program);
        // A group of its own, so that what ends the worker's group does not end the guard before its work is done.
        command
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0);
        let mut child = orphans::start(&mut command)?;
        let input = child.stdin.take().ok_or_else(|| io::Error::other("the guard has no standard input"))?;
        // It ends by itself when its input closes, and is waited for lest it stay as a zombie.
        std::thread::Builder::new().name("guard".to_owned()).spawn(move || {
            let _ = child.wait();
            orphans::forget(child.id().cast_signed());
        })?;
        let guard = Self { input: Arc::new(Mutex::new(input)) };
        guard.notice().tell('*', &orphans::marks_here());
        Ok(guard)
    }

    /// A way to tell it of groups and folders.
    pub(crate) fn notice(&self) -> Notice {
        Notice(Arc::clone(&self.input))
    }
}

/// A way to tell the guard of groups and folders.
#[derive(Clone)]
pub(crate) struct Notice(Arc<Mutex<ChildStdin>>);

impl Notice {
    pub(crate) fn begin(&self, group: u32) {
        self.tell('+', &group.to_string());
    }

    pub(crate) fn end(&self, group: u32) {
        self.tell('-', &group.to_string());
    }

    pub(crate) fn begin_folder(&self, folder: &Path) {
        self.tell_folder('+', folder);
    }

    pub(crate) fn end_folder(&self, folder: &Path) {
        self.tell_folder('-', folder);
    }

    /// A folder inside of one under guard stays.
    pub(crate) fn keep_folder(&self, folder: &Path) {
        self.tell_folder('=', folder);
    }

    /// A path that does not fit on a line is not under guard: it stays when the worker is killed.
    fn tell_folder(&self, sign: char, folder: &Path) {
        if let Some(path) = folder.to_str().filter(|path| !path.contains(['\n', '\r'])) {
            self.tell(sign, path);
        }
    }

    fn tell(&self, sign: char, what: &str) {
        let mut input = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A guard that is gone guards nothing; the run itself goes on.
        let _ = input.write_all(format!("{sign}{what}\n").as_bytes());
    }
}

/// What is under guard.
#[derive(Default)]
struct Guarded {
    groups: BTreeSet<i32>,
    folders: BTreeSet<PathBuf>,
    kept: BTreeSet<PathBuf>,
    /// What the marks of the worker's descendants begin with.
    marks: Option<String>,
}

impl Guarded {
    /// Obeys one line; one that makes no sense is passed over.
    fn hear(&mut self, line: &str) {
        let Some((sign, what)) = line.split_at_checked(1) else { return };
        if what.starts_with('/') {
            let folder = PathBuf::from(what);
            match sign {
                "+" => _ = self.folders.insert(folder),
                "-" => _ = self.folders.remove(&folder),
                "=" => _ = self.kept.insert(folder),
                _ => {}
            }
        } else if sign == "*" {
            self.marks = Some(what.to_owned()).filter(|marks| marks.len() > 1);
        } else if let Ok(group) = what.parse() {
            match sign {
                "+" => _ = self.groups.insert(group),
                "-" => _ = self.groups.remove(&group),
                _ => {}
            }
        }
    }
}

/// Guards the groups and folders that `input` names until it ends, then kills and removes those left.
pub fn guard(input: impl BufRead) {
    let mut guarded = Guarded::default();
    for line in input.lines() {
        let Ok(line) = line else { break };
        guarded.hear(&line);
    }
    for group in guarded.groups {
        kill_group(group);
    }
    if let Some(marks) = guarded.marks {
        orphans::kill_marked(&marks);
    }
    for folder in guarded.folders {
        clear(&folder, &guarded.kept);
    }
}

/// Kills every process of a group; one that is gone already is none.
pub(crate) fn kill_group(group: i32) {
    if let Some(group) = Pid::from_raw(group) {
        let _ = kill_process_group(group, Signal::KILL);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guard_that_is_needed_no_more_leaves_no_process_and_no_zombie() {
        let base = tempfile::tempdir().expect("a folder");
        let written = base.path().join("pid");
        let script = format!("echo $$ > '{}'; exec cat", written.display());
        let guard = Guard::start(Path::new("sh"), &["-c".to_owned(), script]).expect("there is a shell");
        let started = std::time::Instant::now();
        let until = |ready: &dyn Fn() -> bool| {
            while !ready() {
                assert!(started.elapsed() < std::time::Duration::from_secs(60), "waited too long");
                std::thread::yield_now();
            }
        };
        let pid = || std::fs::read_to_string(&written).unwrap_or_default().trim().to_owned();
        until(&|| !pid().is_empty());
        let process = Path::new("/proc").join(pid());
        drop(guard);
        until(&|| !process.exists());
    }

    #[test]
    fn folders_left_under_guard_are_removed_and_those_taken_out_or_kept_stay() {
        let base = tempfile::tempdir().expect("a folder");
        let at = |name: &str| base.path().join(name);
        for name in ["left/run-1", "left/run-2", "out", "never"] {
            std::fs::create_dir_all(at(name)).expect("made");
        }
        let base = base.path().display();
        let lines = format!(
            "+{base}/left\n+{base}/out\n-{base}/out\n={base}/left/run-2\nnonsense\n\n+relative\n+{base}/nowhere\n"
        );
        guard(lines.as_bytes());
        assert!(!at("left/run-1").exists());
        assert!(at("left/run-2").exists() && at("out").exists() && at("never").exists());
    }
}
