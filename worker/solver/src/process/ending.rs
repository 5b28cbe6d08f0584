//! How a program ended: in words, and whether somebody else ended it.

use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

/// How a program ended, in words.
pub(crate) fn ending(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exited with status {code}"),
        (None, Some(9)) => "was killed (signal 9: out of memory, or somebody killed it)".to_owned(),
        (None, Some(signal)) => format!("was ended by signal {signal}"),
        (None, None) => "ended".to_owned(),
    }
}

/// Whether somebody else ended a program, or what a shell or a launcher of MPI started for it: those pass a signal on as 128
/// and its number.
pub(crate) fn is_killed(status: ExitStatus) -> bool {
    matches!(status.signal(), Some(9 | 15)) || matches!(status.code(), Some(137 | 143))
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn a_program_that_was_killed_under_a_wrapper_was_killed_and_one_that_failed_was_not() {
        let ended = |script: &str| {
            let status = Command::new("sh").args(["-c", script]).stderr(Stdio::null()).status();
            is_killed(status.expect("there is a shell"))
        };
        assert!(ended("kill -9 $$") && ended("kill -15 $$"));
        assert!(ended("sh -c 'kill -9 $$'; exit $?") && ended("sh -c 'kill -15 $$'; exit $?"));
        assert!(!ended("exit 3") && !ended("sh -c 'kill -11 $$'; exit $?"));
    }
}
