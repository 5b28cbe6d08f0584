//! Who can reach a run that somebody else made: nobody, where its workers are local.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::{Path, PathBuf};
use std::process::Stdio;

use common::{analyses, kill, output, repository, starlings, wait_until};

/// What the open files of a process are, such as `socket:[4711]`.
fn files(pid: u32) -> Vec<PathBuf> {
    let Ok(folder) = std::fs::read_dir(format!("/proc/{pid}/fd")) else { return Vec::new() };
    folder.flatten().filter_map(|entry| std::fs::read_link(entry.path()).ok()).collect()
}

/// The inodes of the internet sockets of this machine, and of the named sockets that listen.
fn reachable() -> Vec<String> {
    let table = |name: &str| std::fs::read_to_string(Path::new("/proc/net").join(name)).unwrap_or_default();
    let column = |text: &str, at: usize| {
        text.lines()
            .skip(1)
            .filter_map(|l| l.split_whitespace().nth(at).map(str::to_owned))
            .collect::<Vec<_>>()
    };
    let internet = ["tcp", "tcp6", "udp", "udp6"].map(|name| column(&table(name), 9)).concat();
    // The flag of a socket that listens is 00010000.
    let unix = table("unix");
    let listening = unix.lines().filter(|line| line.split_whitespace().nth(3) == Some("00010000"));
    internet
        .into_iter()
        .chain(listening.filter_map(|l| l.split_whitespace().nth(6).map(str::to_owned)))
        .collect()
}

/// A process and all its descendants.
fn family(root: u32) -> Vec<u32> {
    let mut family = vec![root];
    let mut next = 0;
    while next < family.len() {
        let pid = family[next];
        for task in std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten() {
            let children = std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
            family.extend(children.split_whitespace().filter_map(|pid| pid.parse::<u32>().ok()));
        }
        next += 1;
    }
    family
}

#[test]
fn a_run_with_local_workers_can_be_reached_by_no_other_process() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let mut run = starlings()
        .arg("run")
        .arg(repository("examples/rcr/study.toml"))
        .arg("--out")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_until("some analyses", || analyses(&out) > 0);
    let family = family(run.id());
    let held: Vec<PathBuf> = family.iter().flat_map(|pid| files(*pid)).collect();
    let reachable = reachable();
    kill(&mut run);
    assert!(family.len() >= 3, "a coordinator and two workers: {family:?}");
    let is_socket = |file: &PathBuf| file.to_string_lossy().starts_with("socket:[");
    assert!(held.iter().any(is_socket), "they are connected by something: {held:?}");
    for file in held.iter().filter(|file| is_socket(file)) {
        let inode = file.to_string_lossy().trim_start_matches("socket:[").trim_end_matches(']').to_owned();
        assert!(!reachable.contains(&inode), "{file:?} can be reached from outside");
    }
}

#[test]
fn no_escape_sequence_of_a_study_reaches_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("study.toml");
    let hostile = "\\u001b[2J\\u009b31m\\u202e";
    let text = format!("[study]\nname = \"a\"\n\"b{hostile}\" = 1\n[model]\nkind = \"oscillator\"\n");
    std::fs::write(&file, text).unwrap();
    let (code, stdout, stderr) = output(starlings().arg("check").arg(&file));
    assert_eq!(code, 2, "{stderr}");
    for c in ['\u{1b}', '\u{9b}', '\u{202e}'] {
        assert!(!stdout.contains(c) && !stderr.contains(c), "{c:?} in {stderr:?}");
    }
    assert!(stderr.contains('\u{241b}'), "it is shown: {stderr}");
}
