//! A process that outlives its worker by a moment, to end the solvers that the worker leaves behind.
//!
//! The worker holds the writing end of the guard's standard input. A line `+N` puts a process group under guard, `-N` takes it
//! out; when the input ends, however the worker died, every group still under guard is killed. Next file to read:
//! [`super::process`].

use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

use rustix::process::{Pid, Signal, kill_process_group};

/// The guard of this process.
pub(crate) struct Guard {
    input: Arc<Mutex<ChildStdin>>,
    /// Waited for by nobody: it ends by itself after this process.
    _child: Child,
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
        let mut child = command.spawn()?;
        let input = child.stdin.take().ok_or_else(|| io::Error::other("the guard has no standard input"))?;
        Ok(Self { input: Arc::new(Mutex::new(input)), _child: child })
    }

    /// A way to tell it of a group.
    pub(crate) fn notice(&self) -> Notice {
        Notice(Arc::clone(&self.input))
    }
}

/// A way to tell the guard of a group.
#[derive(Clone)]
pub(crate) struct Notice(Arc<Mutex<ChildStdin>>);

impl Notice {
    pub(crate) fn begin(&self, group: u32) {
        self.tell('+', group);
    }

    pub(crate) fn end(&self, group: u32) {
        self.tell('-', group);
    }

    fn tell(&self, sign: char, group: u32) {
        let mut input = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A guard that is gone guards nothing; the run itself goes on.
        let _ = input.write_all(format!("{sign}{group}\n").as_bytes());
    }
}

/// Guards the groups that `input` names until it ends, then kills those left.
pub fn guard(input: impl BufRead) {
    let mut groups = BTreeSet::new();
    for line in input.lines() {
        let Ok(line) = line else { break };
        match line.split_at_checked(1) {
            Some(("+", group)) => groups.extend(group.parse::<i32>()),
            Some(("-", group)) => drop(group.parse::<i32>().map(|group| groups.remove(&group))),
            _ => {}
        }
    }
    for group in groups {
        kill_group(group);
    }
}

/// Kills every process of a group; one that is gone already is none.
pub(crate) fn kill_group(group: i32) {
    if let Some(group) = Pid::from_raw(group) {
        let _ = kill_process_group(group, Signal::KILL);
    }
}
