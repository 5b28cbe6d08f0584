//! The guard of a worker ends what the worker leaves behind, and nothing else.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command};

use starlings_solver::guard;

/// A process in a group of its own that would stay for ten minutes.
fn sleeper() -> Child {
    Command::new("sleep").arg("600").process_group(0).spawn().unwrap()
}

#[test]
fn groups_left_under_guard_are_killed_and_those_taken_out_stay() {
    let (mut left, mut taken_out) = (sleeper(), sleeper());
    guard(format!("+{}\n+{}\n-{1}\n", left.id(), taken_out.id()).as_bytes());
    assert_eq!(left.wait().unwrap().signal(), Some(9));
    assert!(taken_out.try_wait().unwrap().is_none(), "it was taken out before the worker ended");
    taken_out.kill().unwrap();
    taken_out.wait().unwrap();
}
