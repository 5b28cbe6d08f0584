//! How well the ends that progress tells agree with the truth, on three examples: `just time-left` prints a table.
//!
//! Clocks are read, so that a machine with other work shows other numbers; `cargo test` leaves it out.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test, and the table is the result

mod common;

use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::Instant;

use common::{repository, starlings};
use serde_json::Value;

/// Commands on shipped examples: a filter with several passes, an explanation, a batch fit.
const OF: [(&str, &str); 3] =
    [("run", "coarctation/study.toml"), ("explain", "pig-aorta/explain.toml"), ("run", "plate/study.toml")];

/// Share of the time from which what is told counts.
const FROM: f64 = 0.2;
/// The largest error of a told end, as a share of the whole time.
const WITHIN: f64 = 0.25;

/// What was told: when, and which end, s from the beginning.
struct Watched {
    told: Vec<(f64, f64)>,
    took: f64,
}

fn watched(command: &str, study: &str) -> Watched {
    let folder = tempfile::tempdir().unwrap();
    let mut call = starlings();
    call.args(["--log", "json", command]).arg(repository("examples").join(study));
    call.args(["--json", "--workers", "1", "--out"]).arg(folder.path().join("out"));
    let began = Instant::now();
    let mut child = call.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = Vec::new();
    for line in BufReader::new(child.stderr.take().unwrap()).lines() {
        let now = began.elapsed().as_secs_f64();
        let record: Value = serde_json::from_str(&line.unwrap()).unwrap();
        if let Some(left) = record["fields"]["left_s"].as_f64() {
            told.push((now, now + left));
        }
    }
    assert!(child.wait().unwrap().success(), "{command} {study}");
    Watched { told, took: began.elapsed().as_secs_f64() }
}

impl Watched {
    /// The last end that was told by this share of the time, over the true one.
    fn at(&self, share: f64) -> Option<f64> {
        let by = self.told.iter().rev().find(|(now, _)| *now <= share * self.took);
        by.map(|(_, end)| end / self.took)
    }

    /// The largest error of a told end from a share of the time on, and the mean of all of them.
    fn errors(&self, from: f64) -> (f64, f64) {
        let late = self.told.iter().filter(|(now, _)| *now >= from * self.took);
        let off: Vec<f64> = late.map(|(_, end)| (end / self.took - 1.0).abs()).collect();
        (off.iter().copied().fold(0.0, f64::max), off.iter().sum::<f64>() / off.len() as f64)
    }
}

#[test]
#[ignore = "it reads clocks: `just time-left`"]
fn told_ends_are_within_a_quarter_of_the_truth_from_a_fifth_on() {
    let shares = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
    let head = shares.map(|share| format!(" {:.0} % |", 100.0 * share)).concat();
    println!("| command | took |{head} largest error | mean error |");
    println!("|---|---|{}---|---|", "---|".repeat(shares.len()));
    let mut off = Vec::new();
    for (command, study) in OF {
        let watched = watched(command, study);
        let cell =
            |share: f64| watched.at(share).map_or_else(|| " – |".to_owned(), |end| format!(" {end:.2} |"));
        let cells = shares.map(cell).concat();
        let (largest, mean) = watched.errors(FROM);
        println!(
            "| `{command} examples/{study}` | {:.0} s |{cells} {:.0} % | {:.0} % |",
            watched.took,
            100.0 * largest,
            100.0 * mean
        );
        assert!(watched.told.len() > 10, "{command} {study}: {} were told", watched.told.len());
        off.push(largest);
    }
    assert!(off.iter().all(|largest| *largest < WITHIN), "{off:?}");
}
