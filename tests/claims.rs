//! docs/claims.md: every command of its tables is there, and every number of a row stands in the test that the row names, or in
//! what the command prints.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::{Path, PathBuf};

use common::{output, repository, starlings};

/// How a row starts a test.
const TEST: &str = "cargo test --workspace --test ";

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A row of a table: its cells but the last, and the command in the last.
struct Row {
    cells: Vec<String>,
    command: String,
}

fn rows() -> Vec<Row> {
    let page = read(&repository("docs/claims.md"));
    let lines = page.lines().filter(|line| line.starts_with('|'));
    let cells = lines.map(|line| line.trim_matches('|').split(" | ").map(|c| c.trim().to_owned()).collect());
    let cells = cells.filter(|cells: &Vec<String>| cells[0] != "claim" && !cells[0].starts_with("---"));
    let row = |mut cells: Vec<String>| {
        assert_eq!(cells.len(), 5, "{cells:?}");
        let last = cells.pop().unwrap();
        let command = last.split('`').nth(1).unwrap_or_else(|| panic!("no command in {last}")).to_owned();
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{cells:?}");
        Row { cells, command }
    };
    cells.map(row).collect()
}

/// Rust files below a folder of tests, kits included.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Folders named `tests` of every crate.
fn folders_of_tests() -> Vec<PathBuf> {
    let mut found = vec![repository("tests")];
    for below in ["models", "estimators", "coordinator", "worker", "pieces", "proto"] {
        let mut open = vec![repository(below)];
        while let Some(folder) = open.pop() {
            let inside = std::fs::read_dir(&folder).into_iter().flatten().map(|entry| entry.unwrap().path());
            for path in inside.filter(|path| path.is_dir() && !path.ends_with("src")) {
                if path.ends_with("tests") { found.push(path) } else { open.push(path) }
            }
        }
    }
    found
}

/// The text of a test's file with the modules that it names, where the test is in it: `TARGET NAME` after [`TEST`].
fn text_of_test(target: &str, name: &str) -> String {
    let head = format!("fn {name}(");
    for folder in folders_of_tests() {
        let (file, inner) = (folder.join(format!("{target}.rs")), folder.join(target));
        let own: Vec<PathBuf> = if file.exists() {
            vec![file]
        } else if inner.join("main.rs").exists() {
            sources(&inner)
        } else {
            continue;
        };
        let text: String = own.iter().map(|path| read(path)).collect();
        let Some((before, _)) = text.split_once(&head) else { continue };
        let attributes = before.rsplit("\n\n").next().unwrap();
        assert!(attributes.contains("#[test]"), "{name} of {target} is no test");
        let kits =
            text.lines().filter_map(|line| line.trim_start_matches("pub(crate) ").strip_prefix("mod "));
        let kits: String = kits
            .map(|kit| folder.join(kit.trim_end_matches(';')))
            .filter(|kit| kit.is_dir())
            .flat_map(|kit| sources(&kit))
            .map(|path| read(&path))
            .collect();
        // What is left out of a plain run has to be asked for.
        let ignored = if attributes.contains("#[ignore") { "needs -- --ignored\n" } else { "" };
        return format!("{ignored}{}", code(&(text + &kits)));
    }
    panic!("no test `{name}` in a target `{target}`");
}

/// A text without comments, whose numbers nothing holds.
fn code(text: &str) -> String {
    let of_line = |line: &str| {
        // `http://` is no comment.
        let comment = line.match_indices("//").map(|(at, _)| at).find(|at| !line[..*at].ends_with(':'));
        format!("{}\n", &line[..comment.unwrap_or(line.len())])
    };
    text.lines().map(of_line).collect::<Vec<_>>().concat()
}

/// Numbers of a text as they are written: sign left out, `_` between digits taken away.
fn numbers(text: &str) -> Vec<String> {
    let plain: Vec<char> = text.chars().filter(|c| *c != '_').collect();
    let (mut found, mut at) = (Vec::new(), 0);
    let digit = |i: usize| plain.get(i).is_some_and(char::is_ascii_digit);
    while at < plain.len() {
        // `x2` and `pair.0` are names, `0.1..0.2` is two numbers.
        let before = |n: usize| at.checked_sub(n).map(|i| plain[i]);
        let in_name = before(1).is_some_and(char::is_alphanumeric)
            || (before(1) == Some('.') && before(2) != Some('.'));
        if !digit(at) || in_name {
            at += 1;
            continue;
        }
        let start = at;
        while digit(at) {
            at += 1;
        }
        if plain.get(at) == Some(&'.') && digit(at + 1) {
            at += 1;
            while digit(at) {
                at += 1;
            }
        }
        let exponent = usize::from(plain.get(at + 1) == Some(&'-')) + 1;
        if plain.get(at) == Some(&'e') && digit(at + exponent) {
            at += exponent;
            while digit(at) {
                at += 1;
            }
        }
        found.push(plain[start..at].iter().collect());
    }
    found
}

/// Whether a number of the page is one of a text, rounded to the digits that the page shows.
fn stands_in(shown: &str, text: &[f64]) -> bool {
    let value: f64 = shown.parse().unwrap();
    let (mantissa, exponent) = shown.split_once('e').unwrap_or((shown, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let unit = 10_f64.powi(exponent.parse::<i32>().unwrap() - i32::try_from(decimals).unwrap());
    // What has no decimals is not rounded.
    let within = if decimals == 0 { 1e-9 * value.abs() } else { 0.500_001 * unit };
    text.iter().any(|number| (number - value).abs() <= within)
}

/// Numbers of a row that the text beside its command does not have; whole ones below ten count as words.
fn missing(row: &Row, text: &str) -> Vec<String> {
    let there: Vec<f64> = numbers(text).iter().map(|number| number.parse().unwrap()).collect();
    let shown = row.cells.iter().flat_map(|cell| numbers(cell));
    let figures = shown.filter(|number| number.len() > 1);
    figures.filter(|number| !stands_in(number, &there)).collect()
}

/// What holds the numbers of a row: a test's file, a page of figures, what a command prints, what an example expects.
fn holding(command: &str) -> String {
    if let Some(test) = command.strip_prefix(TEST) {
        let words: Vec<&str> = test.split(' ').collect();
        let text = text_of_test(words[0], words[1]);
        let asked = words[2..] == ["--", "--ignored"];
        assert_eq!(asked, text.starts_with("needs -- --ignored"), "{command}");
        return text;
    }
    if let Some(recipe) = command.strip_prefix("just ") {
        assert!(read(&repository("justfile")).contains(&format!("\n{recipe}:\n")), "no recipe {recipe}");
        let page = read(&repository("docs").join(format!("{recipe}.md")));
        assert!(page.contains(&format!("`{command}`")), "docs/{recipe}.md does not name {command}");
        return page;
    }
    let words: Vec<&str> = command.split(' ').collect();
    assert_eq!(words[0], "starlings", "no kind of command that is known: {command}");
    let study = repository(words[2]);
    assert!(study.exists(), "{command}");
    if words[1] == "run" {
        // Every study of an example is run and compared with this.
        let name = words[2].rsplit_once('/').unwrap().1.trim_end_matches(".toml");
        let own = if name == "study" { "expected.toml".to_owned() } else { format!("expected-{name}.toml") };
        return read(&study.with_file_name(own));
    }
    let (code, stdout, stderr) = output(starlings().arg(words[1]).arg(&study).args(&words[3..]));
    assert_eq!(code, 0, "{command}: {stderr}");
    stdout
}

#[test]
fn every_command_of_the_claims_is_there_and_has_the_numbers_of_its_row() {
    let rows = rows();
    assert!(rows.len() > 50, "only {} rows: are they still recognised?", rows.len());
    let mut wrong = Vec::new();
    for row in &rows {
        let absent = missing(row, &holding(&row.command));
        if !absent.is_empty() {
            wrong.push(format!("{}: {absent:?} not in `{}`", row.cells[0], row.command));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn numbers_are_found_as_they_are_written_and_compared_at_the_digits_shown() {
    let all = numbers("f = −0.98 at 3.23e4, to 1e-9; ω₁ of x2, pair.0, 1_000.5..12. Then");
    assert_eq!(all, ["0.98", "3.23e4", "1e-9", "1000.5", "12"]);
    let there = [0.985_341_25, 7.329_375e-3, 50.0];
    for shown in ["0.985341", "0.00733", "7.33e-3", "50"] {
        assert!(stands_in(shown, &there), "{shown}");
    }
    for shown in ["0.985342", "0.98", "0.0074", "7.34e-3", "49"] {
        assert!(!stands_in(shown, &there), "{shown}");
    }
}
