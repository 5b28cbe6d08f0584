//! Many faults in one study, drawn from a seed, change no byte of its posterior, lose no acknowledged run and hang nothing. The whole
//! battery is ignored unless asked for: `just chaos`.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; what is left out is printed

mod access_kit;
mod chaos_kit;
mod common;
mod fault_kit;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use chaos_kit::campaign::{Done, make};
use chaos_kit::plan::May;
use chaos_kit::studies::{SORTS, Sort, has_python};
use chaos_kit::table::{PAGE, Table};
use chaos_kit::{judge, namespaces, studies};
use common::repository;
use starlings_models::Prediction;
use starlings_proto::State;
use starlings_proto::convert::ended;

/// A number of the environment.
fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}

/// One campaign; a panic is what is wrong with it.
fn campaign(seed: u64, sort: Sort, may: May) -> Result<(Vec<Done>, usize), String> {
    catch_unwind(AssertUnwindSafe(|| make(seed, sort, may))).unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<String>().map_or("a panic", String::as_str);
        Err(format!("seed {seed}, {sort:?}: {words}"))
    })
}

/// Makes campaigns, some at a time, until so many faults have happened; what is wrong with them.
fn together(n_fault: usize, at_a_time: usize, seed: u64, sorts: &[Sort], may: May) -> (Table, Vec<String>) {
    let (next, table, wrong) = (AtomicU64::new(seed), Mutex::new(Table::default()), Mutex::new(Vec::new()));
    let work = || {
        while table.lock().unwrap().n() < n_fault && wrong.lock().unwrap().len() < 20 {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            let sort = SORTS[(seed % SORTS.len() as u64) as usize];
            if !sorts.contains(&sort) {
                continue;
            }
            let started = Instant::now();
            match campaign(seed, sort, may) {
                Ok((done, acknowledged)) => {
                    println!(
                        "seed {seed}, {sort:?}: {} faults in {:.0} s",
                        done.len(),
                        started.elapsed().as_secs_f64()
                    );
                    table.lock().unwrap().add(sort, &done, acknowledged);
                }
                Err(fault) => {
                    println!("{fault}");
                    wrong.lock().unwrap().push(fault);
                }
            }
        }
    };
    std::thread::scope(|scope| (0..at_a_time).for_each(|_| drop(scope.spawn(work))));
    (table.into_inner().unwrap(), wrong.into_inner().unwrap())
}

fn told(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} studies:\n{}", wrong.len(), wrong.join("\n\n"));
}

#[test]
fn two_dozen_faults_change_no_byte_lose_no_run_and_hang_nothing() {
    let name = "two_dozen_faults_change_no_byte_lose_no_run_and_hang_nothing";
    if !namespaces::inside() && namespaces::entered(name) {
        return;
    }
    let may = May { namespaces: namespaces::inside(), long: false };
    // A study of every sort but the Python package, which not every machine has.
    let (table, wrong) = together(25, 3, 0, &[Sort::Native, Sort::Command, Sort::Spilled], may);
    println!("{}", table.text());
    told(&wrong);
    assert!(table.n() >= 25);
}

#[test]
fn a_run_that_was_made_again_is_not_the_one_that_was_acknowledged() {
    let out = tempfile::tempdir().unwrap();
    let db = rusqlite::Connection::open(out.path().join("run.db")).unwrap();
    db.execute_batch("CREATE TABLE arrived_runs (body BLOB); CREATE TABLE jobs (cost_s REAL)").unwrap();
    for cost in [0.25, 0.5] {
        let run = Prediction { outputs: vec![1.0], state: State::default(), cost };
        db.execute("INSERT INTO arrived_runs VALUES (?1)", [ended::encode(&Ok(run), cost)]).unwrap();
    }
    let acknowledged = judge::acknowledged(out.path()).unwrap();
    assert_eq!(acknowledged.len(), 2);
    db.execute_batch("INSERT INTO jobs VALUES (0.5), (0.26)").unwrap();
    assert_eq!(judge::lost(out.path(), &acknowledged).unwrap(), 1);
}

#[test]
#[ignore = "takes about ten minutes: `just chaos`"]
fn a_thousand_faults_change_no_byte_lose_no_run_and_hang_nothing() {
    let name = "a_thousand_faults_change_no_byte_lose_no_run_and_hang_nothing";
    if !namespaces::inside() && namespaces::entered(name) {
        return;
    }
    let may = May { namespaces: namespaces::inside(), long: true };
    let mut sorts = SORTS.to_vec();
    if !may.namespaces {
        println!(
            "left out: links that go down and disks that are full, which need namespaces (`unshare -Urmn`)"
        );
    }
    if !has_python() {
        println!("left out: the Python package, which python3 does not have (.ci/solvers)");
        sorts.retain(|sort| *sort != studies::Sort::Python);
    }
    let n_fault = number("CHAOS_FAULTS", 1000) as usize;
    let at_a_time = number("CHAOS_AT_A_TIME", 3) as usize;
    let (table, wrong) = together(n_fault, at_a_time, number("STARLINGS_CHAOS_SEED", 0), &sorts, may);
    println!("{}", table.page(wrong.len()));
    // Not of a few that somebody looks for a cause with.
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() && table.n() >= 1000 {
        std::fs::write(repository(PAGE), table.page(wrong.len())).unwrap();
    }
    told(&wrong);
}
