//! The documents speak of files and tests that exist.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::{Path, PathBuf};

use common::repository;

/// Endings by which a word with a slash is a path.
const ENDINGS: [&str; 7] = [".rs", ".md", ".toml", ".csv", ".py", ".proto", ".svg"];

/// The documents at the root and in `docs/`, with their text.
fn documents() -> Vec<(PathBuf, String)> {
    let listed = |folder: &str| std::fs::read_dir(repository(folder)).unwrap().map(|e| e.unwrap().path());
    let mut files: Vec<PathBuf> =
        listed("").chain(listed("docs")).filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    files.sort();
    assert!(files.len() > 8, "{files:?}");
    files.into_iter().map(|p| (p.clone(), std::fs::read_to_string(p).unwrap())).collect()
}

/// The lines outside code blocks.
fn prose(text: &str) -> String {
    let mut inside = false;
    let lines = text.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        !inside && !fence
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Words that are paths: a slash, a known ending, and no place-holder.
fn paths(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| c.is_whitespace() || "`()[],;".contains(c));
    let words = words.map(|word| word.trim_end_matches(['.', ':']));
    words
        .filter(|w| w.contains('/') && ENDINGS.iter().any(|ending| w.ends_with(ending)))
        .filter(|w| !w.contains(['<', '*']) && !w.contains("://"))
        .collect()
}

#[test]
fn every_path_that_a_document_names_exists() {
    let mut found = 0;
    for (file, text) in documents() {
        for path in paths(&prose(&text)) {
            // From the root, or from the document as a link is written.
            let beside = file.parent().unwrap().join(path);
            assert!(repository(path).exists() || beside.exists(), "{} names {path}", file.display());
            found += 1;
        }
    }
    assert!(found > 40, "only {found} paths: are they still recognised?");
}

#[test]
fn every_relative_link_of_a_document_resolves() {
    let mut found = 0;
    for (file, text) in documents() {
        for link in prose(&text).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = link.split('#').next().unwrap();
            if target.is_empty() || target.contains("://") {
                continue;
            }
            assert!(file.parent().unwrap().join(target).exists(), "{} links to {link}", file.display());
            found += 1;
        }
    }
    assert!(found > 10, "only {found} links: are they still recognised?");
}

/// Names of tests in a stretch of text: backticked sentences in snake case.
fn test_names(text: &str) -> Vec<&str> {
    let is_name = |w: &&str| {
        w.matches('_').count() >= 2
            && w.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
    };
    text.split('`').skip(1).step_by(2).filter(is_name).collect()
}

#[test]
fn every_test_that_holds_an_invariant_stands_in_the_file_named_after_it() {
    let text = std::fs::read_to_string(repository("docs/invariants.md")).unwrap();
    let invariants = text.split("## Invariants").nth(1).unwrap().split("\n## ").next().unwrap();
    let mut found = 0;
    // `name`, `name` (file), `name` (file): the names before each parenthesis belong to the file in it.
    let mut pieces = invariants.split('(').peekable();
    while let Some(piece) = pieces.next() {
        let file = pieces.peek().and_then(|next| next.split(')').next()).unwrap_or_default();
        let names = test_names(piece.split_once(')').map_or(piece, |(_, after)| after));
        if names.is_empty() {
            continue;
        }
        assert!(Path::new(file).extension().is_some_and(|e| e == "rs"), "{names:?} name no file: {file}");
        let source = std::fs::read_to_string(repository(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        for name in names {
            assert!(source.contains(&format!("fn {name}(")), "{file} has no test {name}");
            found += 1;
        }
    }
    assert!(found > 15, "only {found} tests: are they still recognised?");
}
