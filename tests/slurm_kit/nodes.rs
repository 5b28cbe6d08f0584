//! What happens to nodes of the Slurm under test: one dies, one is cut off from all others.

use std::process::Command;

use super::lab;
use crate::common::output;

/// What Slurm says of a node.
pub(crate) fn node_state(node: &str) -> String {
    output(Command::new("sinfo").args(["--noheader", "--format=%T", "--nodes", node])).1.trim().to_owned()
}

/// A node that nothing reaches and that reaches nothing, until this is dropped.
pub(crate) struct Cut(String);

impl Cut {
    pub(crate) fn off(node: &str) -> Self {
        assert!(link(node, "down"), "the link of {node} goes down");
        Self(node.to_owned())
    }
}

impl Drop for Cut {
    fn drop(&mut self) {
        link(&self.0, "up");
    }
}

fn link(node: &str, state: &str) -> bool {
    let link = format!("lab-{node}");
    Command::new("ip").args(["link", "set", &link, state]).status().unwrap().success()
}

/// Ends everything on a node at once, given the worker on it.
///
/// Whoever would tell Slurm of the end of the others dies before them, as all of a machine does at once.
pub(crate) fn kill_node(node: &str, worker: &str) -> Revived {
    let daemon = std::fs::read_to_string(lab().join(format!("run/slurmd-{node}.pid"))).unwrap();
    let script = parent(worker);
    for process in [daemon.trim(), &parent(&script), &script, worker] {
        assert!(Command::new("kill").args(["-9", process]).status().unwrap().success());
    }
    Revived(node.to_owned())
}

/// The process that started a process.
fn parent(pid: &str) -> String {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("PPid:")).unwrap();
    line.trim().to_owned()
}

/// Starts the daemon of a node again when it is dropped, which frees the name of the node for the next test.
pub(crate) struct Revived(String);

impl Drop for Revived {
    fn drop(&mut self) {
        let network = format!("--net=/run/netns/lab-{}", self.0);
        let _ = Command::new("nsenter").args([&network, "slurmd", "-N", &self.0]).status();
    }
}
