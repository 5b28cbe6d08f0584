//! A coordinator that is killed: its folder is free again, its workers come back and bring along what they have done.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; timings are printed

mod common;
mod small_kit;

use std::io::{BufRead, BufReader, Read};
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use common::studies::slow;
use common::{bytes, kill, output, run, starlings, wait_until};
use rusqlite::Connection;
use small_kit::same;

fn free_address() -> SocketAddr {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

fn coordinator(study: &Path, out: &Path, address: SocketAddr, more: &[&str]) -> Child {
    let mut command = starlings();
    command.arg("run").arg(study).arg("--out").arg(out).args(["--listen", &address.to_string()]).args(more);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// A worker that has the access file of a run folder.
fn worker(out: &Path) -> Child {
    let access = out.join("access.json");
    wait_until("there is an access file", || access.exists());
    let mut command = starlings();
    command.args(["-v", "worker", "--slots", "1", "--access"]).arg(access);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn said(child: Child) -> String {
    let output = child.wait_with_output().unwrap();
    String::from_utf8(output.stderr).unwrap()
}

/// Runs that a worker says at its end to have made.
fn made(said: &str) -> i64 {
    let number = said.split("predictions=").nth(1).unwrap_or_else(|| panic!("it does not say: {said}"));
    number.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}

fn count(out: &Path, sql: &str) -> i64 {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    Connection::open_with_flags(out.join("run.db"), flags)
        .and_then(|db| db.query_row(sql, [], |row| row.get(0)))
        .unwrap_or(0)
}

#[test]
fn workers_outlive_their_coordinator_and_no_run_is_made_twice() {
    let dir = tempfile::tempdir().unwrap();
    let study = slow(dir.path(), 10);
    let (whole, broken) = (dir.path().join("whole"), dir.path().join("broken"));
    run(&study, &whole, 2);
    let address = free_address();
    let mut first = coordinator(&study, &broken, address, &[]);
    let workers = [worker(&broken), worker(&broken)];
    wait_until("some runs are in the store", || count(&broken, "SELECT count(*) FROM arrived_runs") > 20);
    kill(&mut first);
    let mut second = coordinator(&study, &broken, address, &["--resume"]);
    let mut text = String::new();
    second.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    assert!(second.wait().unwrap().success(), "{text}");
    assert_eq!(bytes(&whole, "posterior.csv"), bytes(&broken, "posterior.csv"));
    assert_eq!(text.matches("finished runs along").count(), 2, "both come back: {text}");
    let said = workers.map(said);
    let connected = format!("connected to {address} for the run `");
    for words in
        [&*connected, "lost the coordinator", "delivered", "results that were held", "ends: the run is over"]
    {
        assert!(said.iter().all(|said| said.contains(words)), "`{words}` is missing: {said:?}");
    }
    let made: i64 = said.iter().map(|said| made(said)).sum();
    let rows = count(&broken, "SELECT count(*) FROM jobs");
    assert_eq!(rows, count(&whole, "SELECT count(*) FROM jobs"));
    // Beside those that are made again to be compared: the first one of each worker, twice, and of the others two in a hundred.
    let repeated = made - rows;
    assert!((0..=4 + rows / 50).contains(&repeated), "{repeated} runs were made again: {said:?}\n{text}");
}

#[test]
fn the_second_coordinator_in_a_folder_is_told_who_the_first_is() {
    let (dir, study) = small_kit::study(same, same);
    let out = dir.path().join("out");
    let mut first = coordinator(&study, &out, free_address(), &[]);
    // It says where it listens once the folder is its own.
    let mut lines = BufReader::new(first.stderr.take().unwrap()).lines().map_while(Result::ok);
    lines.find(|line| line.contains("listening on")).unwrap();
    let who = format!("(process {} on ", first.id());
    for (command, more) in [("run", None), ("run", Some("--resume")), ("explain", Some("--resume"))] {
        let mut second = starlings();
        second.arg(command).arg(&study).arg("--out").arg(&out).args(more);
        let (code, _, stderr) = output(&mut second);
        assert_eq!(code, 2, "{stderr}");
        let is_told = more.is_none() && stderr.contains("already holds a run") || stderr.contains(&who);
        assert!(is_told, "{command} {more:?}: {stderr}");
    }
    kill(&mut first);
    assert!(out.join("run.lock").exists(), "a killed process leaves its lock behind");
    let mut second = starlings();
    second.arg("run").arg(&study).arg("--out").arg(&out).arg("--resume");
    let (code, _, stderr) = output(&mut second);
    assert_eq!(code, 0, "{stderr}");
    assert!(!out.join("run.lock").exists());
}

/// Times a kill and a resume with so many finished runs of about so many milliseconds.
#[test]
#[ignore = "times a release build: `just deaths`"]
fn ten_workers_are_back_within_ten_seconds_of_a_resume() {
    let dir = tempfile::tempdir().unwrap();
    let study = slow(dir.path(), 200);
    let out = dir.path().join("out");
    let address = free_address();
    let mut first = coordinator(&study, &out, address, &[]);
    let mut workers: Vec<Child> = (0..10).map(|_| worker(&out)).collect();
    wait_until("runs are in the store", || count(&out, "SELECT count(*) FROM arrived_runs") > 100);
    kill(&mut first);
    let kept = count(&out, "SELECT count(*) FROM arrived_runs");
    // The longest wait between two attempts to dial.
    std::thread::sleep(Duration::from_secs(10));
    let started = Instant::now();
    let mut second = coordinator(&study, &out, address, &["--resume"]);
    let lines = BufReader::new(second.stderr.take().unwrap()).lines().map_while(Result::ok);
    let back: Vec<f64> = lines
        .filter(|line| line.contains("finished runs along"))
        .map(|_| started.elapsed().as_secs_f64())
        .take(workers.len())
        .collect();
    println!("{kept} runs kept; workers are back after {back:.2?} s");
    kill(&mut second);
    workers.iter_mut().for_each(kill);
    assert_eq!(back.len(), 10);
    assert!(back.iter().all(|after| *after < 10.0));
}
