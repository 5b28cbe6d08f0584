//! The tables of mistakes, read and made: see `tests/mistakes.rs` for what a block says.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::{output, repository, starlings};

/// The tables with their titles.
pub(crate) const TABLES: [(&str, &str); 3] = [
    ("study", "A study, and a recording out of a spreadsheet"),
    ("program", "A program that reads and writes files"),
    ("package", "A solver in Python"),
];

/// Files of a folder by name.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// One mistake.
pub(crate) struct Mistake {
    pub(crate) what: String,
    pub(crate) files: Files,
    pub(crate) command: String,
    pub(crate) code: i32,
    pub(crate) said: String,
}

fn read(name: &str) -> String {
    std::fs::read_to_string(repository("tests/mistakes").join(name)).unwrap()
}

/// The sound files of a table.
pub(crate) fn base(table: &str) -> Files {
    let text = read(&format!("{table}.base"));
    let parts = text.split("=== ").skip(1).map(|part| part.split_once('\n').unwrap());
    parts.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())).collect()
}

/// A text of a table as bytes: `\n`, `\t` and `\xHH` stand for what they do in other languages.
fn bytes(text: &str) -> Vec<u8> {
    let mut parts = text.split('\\');
    let mut made = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let rest = match part.as_bytes().first() {
            Some(b'n') => {
                made.push(b'\n');
                1
            }
            Some(b't') => {
                made.push(b'\t');
                1
            }
            Some(b'x') => {
                made.push(u8::from_str_radix(&part[1..3], 16).unwrap());
                3
            }
            _ => panic!("`\\{part}` in `{text}`"),
        };
        made.extend(&part.as_bytes()[rest..]);
    }
    made
}

fn mistake(base: &Files, block: &str) -> Mistake {
    let mut lines = block.lines();
    let what = lines.next().unwrap().strip_prefix("# ").unwrap().to_owned();
    let mut made =
        Mistake { what, files: base.clone(), command: String::new(), code: 0, said: String::new() };
    let mut from: Option<String> = None;
    for line in lines {
        if let Some(command) = line.strip_prefix("$ ") {
            command.clone_into(&mut made.command);
        } else if let Some((code, said)) =
            line.split_once(' ').filter(|(code, _)| code.parse::<i32>().is_ok())
        {
            (made.code, made.said) = (code.parse().unwrap(), said.to_owned());
        } else {
            let (file, change) = line.split_once(' ').unwrap();
            let text = bytes(change[1..].strip_prefix(' ').unwrap_or_default());
            if change.starts_with('-') {
                from = Some(String::from_utf8(text).unwrap());
                continue;
            }
            let whole = made.files.get_mut(file).unwrap();
            *whole = match from.take() {
                None => text,
                Some(from) => {
                    let before = String::from_utf8(whole.clone()).unwrap();
                    assert!(before.contains(&from), "{}: no `{from}` in {file}", made.what);
                    before.replace(&from, &String::from_utf8(text).unwrap()).into_bytes()
                }
            };
        }
    }
    assert!(!made.command.is_empty() && !made.said.is_empty(), "{block}");
    made
}

/// The mistakes of a table.
pub(crate) fn mistakes(table: &str) -> Vec<Mistake> {
    let base = base(table);
    read(&format!("{table}.txt")).trim().split("\n\n").map(|block| mistake(&base, block)).collect()
}

/// The first message of what a command says, its lines joined where the display broke them, without log lines.
pub(crate) fn first(stderr: &str) -> String {
    let mut said: Vec<&str> = Vec::new();
    for line in stderr.lines().filter(|line| !line.contains(" WARN ")) {
        let bare = line.trim();
        if bare.contains("╭─") || bare.starts_with("help:") || (bare.is_empty() && !said.is_empty()) {
            break;
        }
        if !bare.is_empty() {
            said.push(bare.trim_start_matches(['×', '│', ' ']).trim());
        }
    }
    let said = said.join(" ");
    said.strip_prefix("error: ").map(str::to_owned).unwrap_or(said)
}

/// Whether a text begins with the first part of a pattern and has the others after it, in order.
pub(crate) fn matches(pattern: &str, text: &str) -> bool {
    let mut parts = pattern.split('…').map(str::trim);
    let Some(mut rest) = text.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    parts.all(|part| match rest.find(part) {
        Some(at) => {
            rest = &rest[at + part.len()..];
            true
        }
        None => false,
    })
}

/// A folder with these files.
pub(crate) fn placed(files: &Files) -> tempfile::TempDir {
    let folder = tempfile::Builder::new().prefix("mistake-").tempdir().unwrap();
    for (name, content) in files {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    folder
}

/// A command in a folder: exit code, standard output, standard error.
pub(crate) fn typed(folder: &Path, command: &str) -> (i32, String, String) {
    let words = shell_words::split(command).unwrap();
    // What failed runs leave goes with the folder.
    output(starlings().current_dir(folder).env("TMPDIR", folder).args(words))
}
