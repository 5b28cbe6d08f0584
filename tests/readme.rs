//! What the README shows: commands that print what stands there, and numbers that stand in the page that measured them.
//!
//! `STARLINGS_WRITE_PAGES=1 cargo test --test readme` writes what is shown again.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use common::{output, repository, starlings};

/// The prompt of a command that the README types.
const PROMPT: &str = "$ cargo run --release -- ";

/// How a part that is left out begins.
const LEFT_OUT: &str = "[ ...";

fn readme() -> String {
    std::fs::read_to_string(repository("README.md")).unwrap()
}

/// Blocks with a command: its words, and what is shown, as parts between empty lines.
fn shown(text: &str) -> Vec<(String, Vec<String>)> {
    let blocks = text.split("\n```").skip(1).step_by(2);
    let with_prompt = blocks.filter_map(|block| block.split_once('\n')?.1.strip_prefix(PROMPT));
    let parts = |block: &str| {
        let (command, rest) = block.split_once('\n').unwrap();
        (command.to_owned(), rest.trim_end().split("\n\n").map(|part| part.trim_end().to_owned()).collect())
    };
    with_prompt.map(parts).collect()
}

/// What differs from run to run, the time it took, is not compared.
fn timeless(text: &str) -> String {
    let Some((before, after)) = text.split_once(" workers in ") else { return text.to_owned() };
    let rest = after.split_once(" s").map_or(after, |(_, rest)| rest);
    format!("{before} workers in # s{rest}")
}

/// What a command prints, in the parts that the README shows: what is left out there is left out.
fn printed(command: &str, parts: &[String]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let words = shell_words::split(command).unwrap();
    let example = words.iter().find(|word| word.starts_with("examples/")).unwrap();
    let name = example.split('/').nth(1).unwrap();
    let to = folder.path().join("examples").join(name);
    copy(&repository("examples").join(name), &to);
    let (code, stdout, stderr) = output(starlings().current_dir(folder.path()).args(words));
    assert_eq!(code, 0, "{stderr}");
    let warnings: Vec<&str> = stderr.lines().filter(|line| line.starts_with("warning: ")).collect();
    let head = if warnings.is_empty() { String::new() } else { warnings.join("\n") + "\n\n" };
    let all = head + stdout.trim_end();
    let mut found: Vec<String> = all.split("\n\n").map(|part| part.trim_end().to_owned()).collect();
    assert_eq!(found.len(), parts.len(), "`{command}` prints other parts:\n{all}");
    for (found, shown) in found.iter_mut().zip(parts) {
        if shown.starts_with(LEFT_OUT) {
            found.clone_from(shown);
        }
    }
    found
}

fn copy(from: &std::path::Path, to: &std::path::Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (path, to) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if path.is_dir() {
            copy(&path, &to);
        } else {
            std::fs::copy(path, to).unwrap();
        }
    }
}

#[test]
fn every_command_of_the_readme_prints_what_it_shows() {
    let text = readme();
    let commands = shown(&text);
    assert!(!commands.is_empty(), "no command is shown: are they still recognised?");
    for (command, parts) in commands {
        let found = printed(&command, &parts);
        if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
            let text = readme().replace(&parts.join("\n\n"), &found.join("\n\n"));
            std::fs::write(repository("README.md"), text).unwrap();
            continue;
        }
        for (found, shown) in found.iter().zip(&parts) {
            let same = timeless(found) == timeless(shown);
            assert!(same, "README.md shows of `{command}`:\n{shown}\nand it prints:\n{found}");
        }
    }
}

#[test]
fn the_coverage_of_the_readme_is_that_of_its_page() {
    let page = std::fs::read_to_string(repository("docs/coverage.md")).unwrap();
    let table = page.split("## Right models").nth(1).unwrap().split("\n## ").next().unwrap();
    let covered: Vec<f64> = table
        .lines()
        .filter(|line| line.starts_with('|'))
        .filter_map(|line| line.split('|').nth(3)?.rsplit_once('(')?.1.split(')').next()?.parse().ok())
        .collect();
    assert!(covered.len() > 4, "{covered:?}");
    let bound = |of: fn(f64, f64) -> f64| (100.0 * covered.iter().copied().reduce(of).unwrap()).round();
    let (least, most) = (bound(f64::min), bound(f64::max));
    let words = ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    let said = format!(
        "{least} to {most} % of the 95 % intervals hold the truth, on {} systems",
        words[covered.len() - 1]
    );
    let readme = readme().replace('\n', " ");
    let flat = readme.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(flat.contains(&said), "README.md does not say: {said}");
}
