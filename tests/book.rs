//! The book: every page is in it, every link and heading is there, every block of code is one, and the page of commands is what the
//! program says.
//!
//! `STARLINGS_WRITE_PAGES=1 cargo test --test book` writes docs/commands.md and docs/gallery.md again.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod page_kit;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{output, repository, starlings};
use page_kit::{Block, blocks};

/// The pages of `docs/` and its folders, without the list of them.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![repository("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") && !path.ends_with("SUMMARY.md") {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(found.len() > 40, "{found:?}");
    found
}

/// Pages, and the documents beside `docs/` that have links.
fn documents() -> Vec<PathBuf> {
    let root = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "GLOSSARY.md", "sdk/python/README.md"];
    pages().into_iter().chain(root.into_iter().map(repository)).collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// Targets of the links of a text, without code.
fn links(text: &str) -> Vec<String> {
    let mut inside = false;
    let prose = text.lines().filter(|line| {
        let fence = line.starts_with("```");
        inside ^= fence;
        !inside && !fence
    });
    let prose = prose.collect::<Vec<_>>().join("\n");
    prose.split("](").skip(1).filter_map(|rest| rest.split(')').next()).map(str::to_owned).collect()
}

/// The names by which links reach the headings of a page.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut inside = false;
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for line in text.lines() {
        inside ^= line.starts_with("```");
        let Some(heading) = line.strip_prefix('#').filter(|_| !inside) else { continue };
        let heading = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let name: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let n = known.entry(name.clone()).or_default();
        found.insert(if *n == 0 { name } else { format!("{name}-{n}") });
        *n += 1;
    }
    found
}

#[test]
fn every_page_stands_once_in_the_list_of_pages() {
    let listed: Vec<PathBuf> = links(&read(&repository("docs/SUMMARY.md")))
        .iter()
        .map(|link| repository("docs").join(link))
        .collect();
    let once: BTreeSet<&PathBuf> = listed.iter().collect();
    assert_eq!(once.len(), listed.len(), "a page stands twice in docs/SUMMARY.md");
    let there: Vec<PathBuf> = pages();
    for page in &there {
        assert!(once.contains(page), "docs/SUMMARY.md does not have {}", page.display());
    }
    for page in listed {
        assert!(there.contains(&page), "docs/SUMMARY.md has {}, which is not there", page.display());
    }
}

#[test]
fn every_link_leads_to_a_file_and_a_heading_that_are_there() {
    let mut found = 0;
    for page in documents() {
        for link in links(&read(&page)) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(target.exists(), "{} links to {link}, which is not there", page.display());
            if !heading.is_empty() && target.extension().is_some_and(|e| e == "md") {
                let anchors = anchors(&read(&target));
                assert!(
                    anchors.contains(heading),
                    "{} links to {link}: no such heading in {anchors:?}",
                    page.display()
                );
            }
            found += 1;
        }
    }
    assert!(found > 200, "only {found} links: are they still recognised?");
}

/// The help of a command, or of a command of a command.
fn help(command: &[&str]) -> String {
    let (code, stdout, stderr) = output(starlings().args(command).arg("--help").env("COLUMNS", "100"));
    assert_eq!(code, 0, "{command:?}: {stderr}");
    stdout.lines().map(str::trim_end).collect::<Vec<_>>().join("\n") + "\n"
}

/// Commands below a command, as its help lists them.
fn below(help: &str) -> Vec<String> {
    let Some(list) = help.split("\nCommands:\n").nth(1) else { return Vec::new() };
    let rows = list.lines().take_while(|line| line.starts_with("  "));
    let names =
        rows.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// Every command with its help, in the order of the list.
fn commands() -> Vec<(Vec<String>, String)> {
    let mut found = Vec::new();
    let mut open: Vec<Vec<String>> = below(&help(&[])).into_iter().rev().map(|name| vec![name]).collect();
    while let Some(command) = open.pop() {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let text = help(&words);
        open.extend(below(&text).into_iter().rev().map(|name| [command.clone(), vec![name]].concat()));
        found.push((command, text));
    }
    found
}

/// Compares a page with what it should be, or writes it.
fn compare(page: &str, wanted: &str) {
    let path = repository(page);
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(&path, wanted).unwrap();
    }
    assert!(
        read(&path) == wanted,
        "{page} is not what it should be: `STARLINGS_WRITE_PAGES=1 cargo test --test book` writes it again"
    );
}

#[test]
fn the_page_of_commands_is_what_the_program_says() {
    let mut page = "# Commands\n\nWhat `--help` says, written by `STARLINGS_WRITE_PAGES=1 cargo test --test book`. `starlings manual DIR` writes the same \
                    as pages for `man`.\n"
        .to_owned();
    let _ = write!(page, "\n```text\n{}```\n", help(&[]));
    let all = commands();
    assert!(all.len() > 25, "{}", all.len());
    for (command, text) in all {
        let _ = write!(page, "\n## starlings {}\n\n```text\n{text}```\n", command.join(" "));
    }
    compare("docs/commands.md", &page);
}

/// Lines of a block in which the program is started, without the prompt.
fn typed(block: &Block) -> Vec<Vec<String>> {
    let kind = block.words.first().map_or("", String::as_str);
    if !matches!(kind, "" | "sh" | "console") {
        return Vec::new();
    }
    let of_line = |line: &String| {
        let bare = line.split_once("$ ").map_or(line.as_str(), |(_, command)| command);
        let command =
            bare.strip_prefix("starlings ").or_else(|| bare.strip_prefix("cargo run --release -- "))?;
        let words = command.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        words.first()?.chars().all(|c| c.is_ascii_lowercase()).then_some(words)
    };
    block.lines.iter().filter_map(of_line).collect()
}

#[test]
fn every_command_in_a_block_is_one_and_has_its_options() {
    let known: BTreeMap<Vec<String>, String> = commands().into_iter().collect();
    let mut found = 0;
    let examples =
        std::fs::read_dir(repository("examples")).unwrap().map(|e| e.unwrap().path().join("README.md"));
    for page in documents().into_iter().chain(examples.filter(|path| path.exists())) {
        // Its blocks are this very text.
        if page.ends_with("commands.md") {
            continue;
        }
        for words in blocks(&read(&page)).iter().flat_map(typed) {
            let two = words.get(..2).and_then(|two| known.get(two));
            let text = two
                .or_else(|| known.get(&words[..1]))
                .unwrap_or_else(|| panic!("{}: there is no `starlings {}`", page.display(), words.join(" ")));
            let own =
                words.iter().take_while(|word| !matches!(word.as_str(), "--" | "|" | "&&" | ";" | ">" | "#"));
            for option in own.filter_map(|word| word.trim_matches(['[', ']', '.']).strip_prefix("--")) {
                let name = option.split(['=', ']']).next().unwrap();
                let named = |word: &str| word.split(['[', '=', ',']).next() == Some(&format!("--{name}"));
                let there = text.split_whitespace().any(named);
                assert!(there, "{}: `starlings {}` has no --{name}", page.display(), words.join(" "));
            }
            found += 1;
        }
    }
    assert!(found > 60, "only {found} commands: are they still recognised?");
}

#[test]
fn every_block_is_what_it_says_that_it_is() {
    let mut python = String::new();
    let mut found = 0;
    for page in documents() {
        for block in blocks(&read(&page)) {
            let Some(kind) = block.words.first() else { continue };
            let place = || format!("{}:\n{}", page.display(), block.text());
            match kind.as_str() {
                "toml" => drop(
                    block
                        .text()
                        .parse::<toml::Table>()
                        .unwrap_or_else(|error| panic!("{error} in {}", place())),
                ),
                "json" => drop(
                    serde_json::from_str::<serde_json::Value>(&block.text())
                        .unwrap_or_else(|error| panic!("{error} in {}", place())),
                ),
                "python" => {
                    let _ = writeln!(
                        python,
                        "compile({:?}, {:?}, 'exec')",
                        block.text(),
                        page.display().to_string()
                    );
                }
                "console" | "sh" | "text" | "csv" | "c" | "jinja" | "proto" | "yaml" | "rust" => {}
                other => panic!("`{other}` is no kind of block that is checked: {}", place()),
            }
            found += 1;
        }
    }
    assert!(found > 60, "only {found} blocks: are they still recognised?");
    let checked = Command::new("python3").arg("-c").arg(python).output().unwrap();
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
}

/// The title, the question and the commands of an example's page.
fn told(example: &Path) -> (String, String) {
    let text = read(&example.join("README.md"));
    let title = text.lines().next().unwrap().trim_start_matches("# ").to_owned();
    let (_, title) = title.split_once(": ").map_or(("", title.as_str()), |(name, rest)| (name, rest));
    let first = text.split("\n\n").nth(1).unwrap_or_default().replace('\n', " ");
    let question = first.strip_prefix("**Question.** ").unwrap_or(&first).to_owned();
    (title.to_owned(), question)
}

#[test]
fn the_gallery_has_every_example() {
    let mut page = "# Gallery of examples\n\nEvery folder of `examples/` is a study that a test runs and compares with what its README expects. Figures are \
                    those of its report, written by `just gallery`; this page by `STARLINGS_WRITE_PAGES=1 cargo test --test book`.\n"
        .to_owned();
    let mut examples: Vec<PathBuf> =
        std::fs::read_dir(repository("examples")).unwrap().map(|e| e.unwrap().path()).collect();
    examples.retain(|path| path.join("README.md").exists());
    examples.sort();
    assert!(examples.len() > 25, "{examples:?}");
    for example in examples {
        let name = example.file_name().unwrap().to_string_lossy().into_owned();
        let (title, question) = told(&example);
        let _ = write!(page, "\n## [{name}](../examples/{name}): {title}\n\n{question}\n");
        let figure = format!("docs/pictures/{name}.svg");
        if repository(&figure).exists() {
            let _ = write!(page, "\n![Model and data of {name}](pictures/{name}.svg)\n");
        }
    }
    compare("docs/gallery.md", &page);
}
