//! Pages that are done as they say: files written, commands typed, what they print compared with what the page shows.
//!
//! Fences say what a block is: `file=NAME` is that file, `append=NAME` goes to its end, `from=PATH` is quoted from there, and of
//! a `console` block the lines after `$ ` are typed and the others must come out, in that order.

#![allow(clippy::unwrap_used, dead_code)] // a failed unwrap is a failed test; every test file uses its own part

use std::path::Path;
use std::process::Command;

use crate::common::repository;

/// A fenced block: the words behind the fence, and the lines inside.
pub(crate) struct Block {
    pub(crate) words: Vec<String>,
    pub(crate) lines: Vec<String>,
}

impl Block {
    /// The value of `key=` behind the fence.
    pub(crate) fn value(&self, key: &str) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    pub(crate) fn is_console(&self) -> bool {
        self.words.first().is_some_and(|word| word == "console")
    }

    pub(crate) fn text(&self) -> String {
        self.lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect()
    }

    /// Commands, each with the lines that it must print.
    pub(crate) fn commands(&self) -> Vec<(&str, Vec<&str>)> {
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

/// The text of a page.
pub(crate) fn page(name: &str) -> String {
    std::fs::read_to_string(repository("docs").join(name)).unwrap()
}

pub(crate) fn blocks(page: &str) -> Vec<Block> {
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
pub(crate) fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// With the binary under test before everything else that is found by its name.
fn search_path() -> std::ffi::OsString {
    let beside = Path::new(env!("CARGO_BIN_EXE_starlings")).parent().unwrap().to_path_buf();
    let others = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(beside).chain(std::env::split_paths(&others))).unwrap()
}

/// Types a command and looks for the lines that it must print.
pub(crate) fn typed(folder: &Path, command: &str, shown: &[&str]) {
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

/// Does in a folder what a page says.
pub(crate) fn follow(page: &str, folder: &Path) {
    for block in blocks(page) {
        if let Some(name) = block.value("file") {
            std::fs::write(folder.join(name), block.text()).unwrap();
        } else if let Some(name) = block.value("append") {
            let path = folder.join(name);
            let before = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, before + &block.text()).unwrap();
        } else if block.is_console() {
            block.commands().iter().for_each(|(command, shown)| typed(folder, command, shown));
        }
    }
}

/// What a page quotes of a file stands there; how many quotations there are.
pub(crate) fn quotations(page: &str) -> usize {
    let mut quoted = 0;
    for block in blocks(page) {
        let Some(path) = block.value("from") else { continue };
        let whole = std::fs::read_to_string(repository(path)).unwrap();
        assert!(whole.contains(&block.text()), "{path} does not have:\n{}", block.text());
        quoted += 1;
    }
    quoted
}
