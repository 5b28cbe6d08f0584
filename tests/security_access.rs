//! What proves a coordinator and its workers to each other, with the real commands. Each test is one property.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod small_kit;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use access_kit::{Started, address, listening, parts, token, value, worker};
use common::{analyses, bytes, kill, output, repository, run, starlings, wait_until};

const RCR: &str = "examples/rcr/study.toml";

#[test]
fn the_files_of_an_access_are_their_owners_alone_whatever_the_mask() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let mut open = Command::new("sh");
    open.args(["-c", "umask 0; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_starlings"), "run"]);
    open.arg(repository(RCR)).args(["--listen", "127.0.0.1:0", "--out"]).arg(&out);
    let coordinator = Started::of(&mut open);
    coordinator.await_words("listening on ");
    for part in parts(&out) {
        assert_eq!(std::fs::metadata(&part).unwrap().mode() & 0o777, 0o600, "{}", part.display());
    }
    let others: Vec<_> = std::fs::read_dir(&out).unwrap().flatten().map(|entry| entry.path()).collect();
    for file in others.iter().filter(|file| !parts(&out).contains(file)) {
        let content = std::fs::read(file).unwrap();
        let secret = token(&parts(&out)[0]);
        let held = content.windows(secret.len()).any(|window| window == secret.as_bytes());
        assert!(!held, "the token stands in {}", file.display());
    }
}

/// What other users of the machine, or this user's other processes, see of a process.
fn shown(pid: u32) -> String {
    let read = |name: &str| std::fs::read(format!("/proc/{pid}/{name}")).unwrap_or_default();
    String::from_utf8_lossy(&[read("cmdline"), read("environ")].concat()).into_owned()
}

#[test]
fn no_secret_stands_in_the_arguments_or_the_environment_of_a_process() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let coordinator =
        listening("run", &repository("examples/pig-aorta/study.toml"), &["--out", out.to_str().unwrap()]);
    let [access, _] = parts(&out);
    let worker = worker(&access, &[]);
    wait_until("some analyses", || analyses(&out) > 0);
    let secret = token(&access);
    for pid in [coordinator.child.id(), worker.child.id()] {
        let shown = shown(pid);
        assert!(shown.contains("starlings") && !shown.contains(&secret[..16]), "{shown}");
    }
    let said = format!("{}{}", coordinator.said(), worker.said());
    assert!(!said.contains(&secret[..16]), "{said}");
}

#[test]
fn insecure_says_what_it_gives_up_on_both_sides_and_each_side_alone_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let mut open = listening("run", &repository(RCR), &["--insecure", "--out", out.to_str().unwrap()]);
    let said = open.said();
    assert!(said.contains("nothing is encrypted") && said.contains("decide its result"), "{said}");
    assert!(parts(&out).iter().all(|part| !part.exists()), "there is nothing to prove");
    let line = said.lines().find(|line| line.starts_with("listening on ")).unwrap();
    let address = line["listening on ".len()..].split(';').next().unwrap();
    assert!(line.contains(&format!("worker --connect {address} --insecure")), "{line}");
    let (code, _, said) = output(starlings().args(["worker", "--connect", address]));
    assert!(code == 2 && said.contains("--access FILE") && said.contains("--insecure"), "{said}");
    let (code, _, said) = output(starlings().args(["worker", "--connect", address, "--insecure"]));
    assert!(code == 0 && said.contains("whoever answers there is taken for the coordinator"), "{said}");
    assert_eq!(open.end(), Some(0), "{}", open.said());
}

#[test]
fn an_insecure_worker_is_not_taken_by_a_coordinator_that_asks_for_proof_and_is_told_why() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let coordinator = listening("run", &repository(RCR), &["--out", out.to_str().unwrap()]);
    let address = address(&parts(&out)[0]);
    let (code, _, said) =
        output(starlings().args(["worker", "--connect", &address, "--insecure", "--patience", "0.2"]));
    assert!(code == 1 && said.contains("--access FILE"), "{said}");
    coordinator.await_words("does not speak TLS");
}

#[test]
fn every_address_of_a_machine_is_listened_to_with_proof_and_named_so_that_others_can_dial_it() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let mut call = starlings();
    call.arg("run").arg(repository(RCR)).args(["--listen", "0.0.0.0:0", "--out"]).arg(&out);
    let mut coordinator = Started::of(&mut call);
    coordinator.await_words("listening on ");
    let [access, _] = parts(&out);
    let addresses = value(&access, "addresses");
    assert!(
        addresses.as_array().unwrap().len() > 1 && !addresses.to_string().contains("0.0.0.0"),
        "{addresses}"
    );
    // The first ones may lead nowhere here: then the next is dialled.
    assert_eq!(worker(&access, &[]).end(), Some(0));
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
}

#[test]
fn an_access_file_serves_one_command_at_a_time_and_says_when_its_run_has_ended() {
    let dir = tempfile::tempdir().unwrap();
    let access = dir.path().join("pool.json");
    let name = access.to_str().unwrap();
    let [one, two] = ["one", "two"].map(|name| dir.path().join(name).display().to_string());
    let mut first = listening("run", &repository(RCR), &["--access", name, "--out", &one]);
    let mut call = starlings();
    call.arg("run").arg(repository(RCR)).args(["--listen", "127.0.0.1:0", "--access", name, "--out", &two]);
    let (code, _, said) = output(&mut call);
    assert!(code == 2 && said.contains("in use by another command"), "{said}");
    assert!(!Path::new(&two).exists());
    let interrupted = Command::new("kill").args(["-INT", &first.child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(first.end(), Some(130));
    assert_eq!(value(&access, "ended"), true);
    let (code, _, said) = output(starlings().args(["worker", "--access", name]));
    assert!(code == 2 && said.contains("has ended"), "{said}");
}

#[test]
fn one_worker_that_stays_serves_run_explain_and_identify_and_its_copy_of_the_file_stays_good() {
    let dir = tempfile::tempdir().unwrap();
    let access = dir.path().join("pool.json");
    let name = access.to_str().unwrap();
    let study = repository("examples/oscillator/study.toml");
    let [out, why] = ["run", "why"].map(|name| dir.path().join(name).display().to_string());
    let mut command = listening("run", &study, &["--access", name, "--out", &out]);
    let mut pool = worker(&access, &["--stay", "--idle", "60s"]);
    let copy = token(&access);
    assert_eq!(command.end(), Some(0), "{}", command.said());
    for (command, options) in [
        ("explain", &["--access", name, "--out", &why, "--budget", "200"][..]),
        ("identify", &["--access", name]),
    ] {
        let mut command = listening(command, &study, options);
        assert_eq!(command.end(), Some(0), "{}", command.said());
        assert_eq!(token(&access), copy);
    }
    assert!(pool.child.try_wait().unwrap().is_none(), "it waits for more: {}", pool.said());
    let _ = Command::new("kill").args(["-TERM", &pool.child.id().to_string()]).status();
    assert_eq!(pool.end(), Some(0));
}

#[test]
fn a_coordinator_that_was_killed_and_resumed_is_found_again_with_the_same_secrets() {
    let dir = tempfile::tempdir().unwrap();
    let (whole, broken) = (dir.path().join("whole"), dir.path().join("broken"));
    let study = repository("examples/pig-aorta/study.toml");
    run(&study, &whole, 1);
    let out = broken.to_str().unwrap();
    let mut first = listening("run", &study, &["--out", out]);
    let [access, _] = parts(&broken);
    let mut pool = worker(&access, &[]);
    wait_until("some analyses", || analyses(&broken) > 100);
    kill(&mut first.child);
    let secret = token(&access);
    let mut second = listening("run", &study, &["--out", out, "--resume"]);
    assert_eq!((second.end(), pool.end()), (Some(0), Some(0)), "{} {}", second.said(), pool.said());
    assert_eq!(token(&access), secret);
    assert_eq!(bytes(&whole, "posterior.csv"), bytes(&broken, "posterior.csv"));
}

/// Size of all files of a folder.
fn size(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).unwrap().flatten();
    files.map(|entry| entry.metadata().map_or(0, |file| file.len())).sum()
}

#[test]
fn a_thousand_bad_callers_leave_the_posterior_byte_equal_and_the_run_folder_small() {
    let dir = tempfile::tempdir().unwrap();
    let (quiet, noisy) = (dir.path().join("quiet"), dir.path().join("noisy"));
    let study = repository(RCR);
    run(&study, &quiet, 1);
    let mut coordinator = listening("run", &study, &["--out", noisy.to_str().unwrap()]);
    let [access, _] = parts(&noisy);
    let address = address(&access);
    let mut pool = None;
    for i in 0..1000 {
        // The last ones come while it works; when it is done nobody listens.
        let Ok(mut caller) = TcpStream::connect(&address) else { break };
        let hostile: &[u8] =
            if i % 2 == 0 { b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" } else { b"GET / HTTP/1.1\r\n\r\n" };
        let _ = caller.write_all(hostile);
        let _ = caller.set_read_timeout(Some(Duration::from_secs(30)));
        let _ = caller.read_to_end(&mut Vec::new());
        if i == 900 {
            pool = Some(worker(&access, &[]));
        }
    }
    assert_eq!(pool.expect("it listened until then").end(), Some(0));
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    assert_eq!(bytes(&quiet, "posterior.csv"), bytes(&noisy, "posterior.csv"));
    let (quiet, noisy) = (size(&quiet), size(&noisy));
    assert!(noisy < quiet + quiet / 4 + 256 * 1024, "{quiet} bytes without and {noisy} with them");
    let refusals = coordinator.said().lines().filter(|line| line.contains("refused")).count();
    assert!((1..=8).contains(&refusals), "{}", coordinator.said());
}

#[test]
fn identify_makes_no_run_folder_and_asks_where_its_access_file_goes() {
    let (_dir, study) = small_kit::study(small_kit::same, small_kit::same);
    let (code, _, said) = output(starlings().arg("identify").arg(&study).args(["--listen", "127.0.0.1:0"]));
    assert!(code == 2 && said.contains("--access FILE"), "{said}");
}

#[test]
fn a_file_that_is_no_access_file_is_not_overwritten() {
    let (dir, study) = small_kit::study(small_kit::same, small_kit::same);
    let out = dir.path().join("run");
    let before = std::fs::read(&study).unwrap();
    let mut call = starlings();
    call.arg("run")
        .arg(&study)
        .args(["--listen", "127.0.0.1:0", "--out"])
        .arg(&out)
        .arg("--access")
        .arg(&study);
    let (code, _, said) = output(&mut call);
    assert_eq!(code, 2, "{said}");
    assert_eq!(std::fs::read(&study).unwrap(), before);
    assert!(!out.exists());
}

#[test]
fn a_wait_for_workers_names_the_access_file_and_the_last_refused_caller() {
    let (dir, study) =
        small_kit::study(|text| text.replace("workers = 1", "workers = 1\npatience = 2"), small_kit::same);
    let out = dir.path().join("run");
    let mut coordinator = listening("run", &study, &["--out", out.to_str().unwrap()]);
    let mut caller = TcpStream::connect(address(&parts(&out)[0])).unwrap();
    caller.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    assert_eq!(coordinator.end(), Some(1));
    let said = coordinator.said();
    for words in [
        "no worker is connected",
        "one caller was refused",
        "does not speak TLS",
        parts(&out)[0].to_str().unwrap(),
        "`patience` under `[fleet]`",
        "starlings worker --access",
    ] {
        assert!(said.contains(words), "`{words}` is missing in {said}");
    }
}

#[test]
fn a_study_without_a_solver_pins_none() {
    let mut call = starlings();
    call.args(["worker", "--access", "none.json", "--solver-from"])
        .arg(repository("examples/oscillator/study.toml"));
    let (code, _, said) = output(&mut call);
    assert!(code == 2 && said.contains("runs in no program of its own"), "{said}");
}
