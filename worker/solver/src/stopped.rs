//! Whether somebody stopped a program (SIGSTOP, a debugger): its silence then says nothing of the run that it was making.
//!
//! Read from `/proc`; where a system has none, nothing is known to be stopped. Next file to read: [`super::process`].

use std::collections::BTreeMap;
use std::fs;

/// Whether a process, or one that it started, is stopped.
pub(crate) fn is_stopped(leader: i32) -> bool {
    let all = processes();
    let of_leader = |mut pid: i32| {
        // A chain of parents is no longer than there are processes.
        for _ in 0..=all.len() {
            if pid == leader {
                return true;
            }
            match all.get(&pid) {
                Some((parent, _)) => pid = *parent,
                None => return false,
            }
        }
        false
    };
    all.iter().any(|(pid, (_, state))| matches!(state, 'T' | 't') && of_leader(*pid))
}

/// What is told of a program that somebody stopped, and that had so many seconds.
pub(crate) fn stopped(program: &str, seconds: f64) -> String {
    format!("{program} was stopped by somebody (SIGSTOP) and did not answer within {seconds} s; it was ended")
}

/// Parent and state of every process, by its number.
fn processes() -> BTreeMap<i32, (i32, char)> {
    let read = |entry: fs::DirEntry| {
        let pid = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        // The name of the program stands in brackets and may hold anything.
        let mut fields = stat.rsplit_once(") ")?.1.split(' ');
        let state = fields.next()?.chars().next()?;
        Some((pid, (fields.next()?.parse().ok()?, state)))
    };
    fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok).filter_map(read).collect()
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    #[test]
    fn a_program_is_stopped_with_any_that_it_started() {
        let mut shell = Command::new("sh")
            .args(["-c", "sh -c 'kill -STOP $$' & wait"])
            .spawn()
            .expect("there is a shell");
        let leader = shell.id().cast_signed();
        let started = std::time::Instant::now();
        while !is_stopped(leader) {
            assert!(started.elapsed().as_secs() < 60, "its child stops itself");
            std::thread::yield_now();
        }
        let child =
            processes().into_iter().find(|(_, (parent, _))| *parent == leader).expect("it is there").0;
        assert!(is_stopped(child));
        for (pid, sign) in [(child, "-KILL"), (leader, "-KILL")] {
            let killed = Command::new("kill").args([sign, &pid.to_string()]).status();
            assert!(killed.is_ok_and(|status| status.success()));
        }
        shell.wait().expect("it ends");
        assert!(!is_stopped(leader));
    }
}
