//! The page that takes a newcomer from a function to a posterior, done as it says: its files written, its commands typed, what
//! they print compared with what it shows.
//!
//! Fences say what a block is: `file=NAME` is that file, `append=NAME` goes to its end, `from=PATH` is quoted from there, and of
//! a `console` block the lines after `$ ` are typed and the others must come out, in that order.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; how long it took is of interest

mod common;

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use common::{repository, starlings};

/// How long the page promises that it takes at most, seconds.
const PROMISED: f64 = 600.0;

/// A fenced block: the words behind the fence, and the lines inside.
struct Block {
    words: Vec<String>,
    lines: Vec<String>,
}

impl Block {
    /// The value of `key=` behind the fence.
    fn value(&self, key: &str) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    fn is_console(&self) -> bool {
        self.words.first().is_some_and(|word| word == "console")
    }

    fn text(&self) -> String {
        self.lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect()
    }

    /// Commands, each with the lines that it must print.
    fn commands(&self) -> Vec<(&str, Vec<&str>)> {
        let mut commands: Vec<(&str, Vec<&str>)> = Vec::new();
        for line in &self.lines {
            match line.strip_prefix("$ ") {
                Some(command) => commands.push((command, Vec::new())),
                None => commands.last_mut().expect("a command comes first").1.push(line),
            }
        }
        commands
    }
}

fn page() -> String {
    std::fs::read_to_string(repository("docs/plug-in.md")).unwrap()
}

fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if let Some(fence) = line.strip_prefix("```") {
            inside = !inside;
            if inside {
                let words = fence.split_whitespace().map(str::to_owned).collect();
                found.push(Block { words, lines: Vec::new() });
            }
        } else if inside {
            found.last_mut().unwrap().lines.push(line.to_owned());
        }
    }
    assert!(!inside, "a fence is left open");
    found
}

/// Columns are as wide as their widest cell: only the words count.
fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// With the binary under test before everything else that is found by its name.
fn search_path() -> std::ffi::OsString {
    let beside = Path::new(env!("CARGO_BIN_EXE_starlings")).parent().unwrap().to_path_buf();
    let others = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(beside).chain(std::env::split_paths(&others))).unwrap()
}

/// Types a command and looks for the lines that it must print.
fn typed(folder: &Path, command: &str, shown: &[&str]) {
    let output = Command::new("sh")
        .args(["-c", &format!("{{ {command}\n}} 2>&1")])
        .current_dir(folder)
        .env("PATH", search_path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "`{command}` ends with {}:\n{said}", output.status);
    let mut lines = said.lines().map(words);
    for line in shown {
        assert!(
            lines.any(|said| said == words(line)),
            "`{command}` does not print, or not in this place, `{line}`:\n{said}"
        );
    }
}

#[test]
#[ignore = "needs the Python package: .ci/solvers"]
fn a_newcomer_who_does_what_the_page_says_gets_the_posterior_that_it_shows() {
    let (folder, started) = (tempfile::tempdir().unwrap(), Instant::now());
    for block in blocks(&page()) {
        if let Some(name) = block.value("file") {
            std::fs::write(folder.path().join(name), block.text()).unwrap();
        } else if let Some(name) = block.value("append") {
            let path = folder.path().join(name);
            let before = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, before + &block.text()).unwrap();
        } else if block.is_console() {
            block.commands().iter().for_each(|(command, shown)| typed(folder.path(), command, shown));
        }
    }
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
    let mut quoted = 0;
    for block in blocks(&page()) {
        let Some(path) = block.value("from") else { continue };
        let whole = std::fs::read_to_string(repository(path)).unwrap();
        assert!(whole.contains(&block.text()), "{path} does not have:\n{}", block.text());
        quoted += 1;
    }
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
