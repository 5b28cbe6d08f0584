//! The page that takes a newcomer from a function to a posterior, done as it says: its files written, its commands typed, what
//! they print compared with what it shows.
//!
//! Next file to read: `page_kit`, which says what a block is.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; how long it took is of interest

mod common;
mod page_kit;

use std::time::Instant;

use common::starlings;
use page_kit::{Block, blocks, follow, quotations, words};

/// How long the page promises that it takes at most, seconds.
const PROMISED: f64 = 600.0;

fn page() -> String {
    page_kit::page("plug-in.md")
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn a_newcomer_who_does_what_the_page_says_gets_the_posterior_that_it_shows() {
    let (folder, started) = (tempfile::tempdir().unwrap(), Instant::now());
    follow(&page(), folder.path());
    let seconds = started.elapsed().as_secs_f64();
    println!("every command of the page: {seconds:.1} s");
    assert!(seconds < PROMISED, "the commands alone take {seconds:.0} s");
}

#[test]
fn the_page_leads_to_a_posterior_and_shows_it() {
    let all = blocks(&page());
    let commands: Vec<(&str, Vec<&str>)> =
        all.iter().filter(|b| b.is_console()).flat_map(Block::commands).collect();
    for command in ["check", "conformance", "run", "explain"] {
        let start = format!("starlings {command} ");
        let shown = commands.iter().find(|(typed, _)| typed.starts_with(&start)).map(|(_, shown)| shown);
        assert!(
            shown.is_some_and(|lines| !lines.is_empty()),
            "`{command}` is typed, and what it prints is shown"
        );
    }
    for kind in ["python", "toml"] {
        let is_file = |block: &&Block| block.words[0] == kind && block.value("file").is_some();
        assert!(all.iter().filter(is_file).count() > 1, "files of {kind} are written");
    }
    // Every study that is run is a file of the page, or made of one by a command before.
    for (command, _) in commands.iter().filter(|(command, _)| command.starts_with("starlings run ")) {
        let study = command.split(' ').nth(2).unwrap();
        let made = commands.iter().any(|(typed, shown)| {
            typed.ends_with(&format!("> {study}")) || shown.iter().any(|line| line.ends_with(study))
        });
        assert!(made || all.iter().any(|b| b.value("file") == Some(study)), "{study} is made nowhere");
    }
}

#[test]
fn what_the_page_quotes_of_an_example_stands_there() {
    let quoted = quotations(&page());
    assert!(quoted > 3, "only {quoted} quotations: are they still recognised?");
}

/// A solver in Python with this as its body.
fn body(lines: &str) -> String {
    format!(
        "import os, time, numpy, starlings\n\n@starlings.solver(parameters={{'k': '1/s'}}, outputs={{'y': 'm'}})\n\
         def solver(window):\n    {lines}\n\nstarlings.serve(solver)\n"
    )
}

/// A solver that speaks another protocol.
const OTHER_PROTOCOL: &str = "
import starlings, starlings.wire
starlings.wire.PROTOCOL = 99
starlings.serve(starlings.solver(parameters={'k': '1/s'}, outputs={'y': 'm'})(lambda window: window.times))
";

/// What goes wrong, what is set for it, and the words that are said and that the page quotes.
fn troubles() -> Vec<(String, &'static str, &'static str)> {
    let twice = "import starlings\nk = starlings.Quantity('k', '1/s')\n\
                 starlings.serve(starlings.solver(parameters=[k, k], outputs={'y': 'm'})(lambda window: window.times))\n";
    vec![
        ("raise SystemExit(3)".to_owned(), "", "exited with status 3 before it was ready"),
        ("import time; time.sleep(60)".to_owned(), "start_timeout = 1", "was not ready within 1 s"),
        (OTHER_PROTOCOL.to_owned(), "", "it speaks protocol 99, this worker speaks 2"),
        (twice.to_owned(), "", "parameters name `k` twice"),
        (body("raise ValueError('mesh folded over')"), "", "ValueError: mesh folded over"),
        (body("return window.times*numpy.nan"), "", "is not a finite number at t = 0"),
        (body("return numpy.zeros((1, 61))"), "", "the array of shape (1, 61) is transposed"),
        (body("return [1.0]"), "", "expected 61 numbers (temperature), got 1"),
        (body("time.sleep(60)"), "timeout = 1", "did not answer within 1 s and was ended"),
        (body("os.kill(os.getpid(), 11)"), "", "was ended by signal 11 during a run"),
        (body("os.kill(os.getpid(), 9)"), "", "was killed (signal 9: out of memory, or somebody killed it)"),
        (body("return [0]*10**9"), "memory = \"2 GiB\"", "MemoryError"),
    ]
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn what_the_page_says_that_is_said_when_it_goes_wrong_is_said() {
    let (page, folder) = (page(), tempfile::tempdir().unwrap());
    let rows: Vec<String> = (0..61).map(|i| format!("{i},0\n")).collect();
    std::fs::write(folder.path().join("data.csv"), format!("time,y\n{}", rows.concat())).unwrap();
    for (script, setting, said) in troubles() {
        assert!(page.contains(said), "the page does not say `{said}`");
        std::fs::write(folder.path().join("bad.py"), script.replace("'y'", "'temperature'")).unwrap();
        let study = format!(
            "[study]\nname = \"bad\"\n[model]\nkind = \"solver\"\ncommand = [\"python3\", \"bad.py\"]\n{setting}\n\
             [[parameters]]\nname = \"k\"\nunit = \"1/s\"\nprior = {{ transform = \"log\", median = 1, factor = 2 }}\n\
             [[records]]\nname = \"a\"\nfile = \"data.csv\"\n\
             channels = [{{ column = \"y\", output = \"temperature\", noise = 1 }}]\n[estimator]\nkind = \"batch\"\n"
        );
        std::fs::write(folder.path().join("bad.toml"), study).unwrap();
        let output = starlings().arg("check").arg(folder.path().join("bad.toml")).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr).replace('│', " ");
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(words(&told).contains(said), "`{said}` is missing in: {told}");
    }
}
