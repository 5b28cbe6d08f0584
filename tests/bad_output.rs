//! Files that a command cannot or must not write are told before anything runs.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod small_kit;

use std::fs;

use common::{output, starlings};
use small_kit::{same, study};

/// Runs a command on the small study and expects it to be refused with `words` before anything is written to `out`.
fn refused_output(command: &[&str], words: &[&str]) {
    let (dir, file) = study(same, same);
    let names = || {
        let mut names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    let mut call = starlings();
    call.current_dir(dir.path()).arg(command[0]).arg(&file).args(&command[1..]);
    let (code, stdout, stderr) = output(&mut call);
    assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
    for word in words {
        assert!(stderr.contains(word), "no `{word}` in: {stderr}");
    }
    // No ensemble was announced, and nothing is left behind.
    assert!(!stderr.contains("runs of the model"), "{stderr}");
    assert_eq!(names(), before);
}

#[test]
fn two_outputs_to_one_file_are_refused() {
    let words = ["both name", "choose two files"];
    refused_output(&["simulate", "-o", "z.csv", "--state-out", "z.csv"], &words);
    refused_output(&["simulate", "-o", "z.csv", "--state-out", "./z.csv"], &words);
    refused_output(&["identify", "--csv", "x", "--html", "x"], &["--html and --csv both name"]);
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_anything_runs() {
    refused_output(&["identify", "--html", "nope/a.html"], &["cannot write nope/a.html (--html)"]);
    refused_output(&["identify", "--csv", "."], &["cannot write . (--csv)"]);
    refused_output(&["identify", "--csv", "data.csv"], &["would be overwritten", "another file with --csv"]);
    refused_output(&["simulate", "--state-out", "nope/a.csv"], &["cannot write nope/a.csv (--state-out)"]);
}

#[test]
fn a_grid_of_too_many_rows_is_called_so() {
    refused_output(&["simulate", "--until", "1", "--step", "1e-9"], &["1.0e9 rows", "larger step"]);
}
