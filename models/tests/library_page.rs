//! The page of the built-in effects says what the library says.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::fmt::Write as _;

use starlings_models::effect::EffectParameter;
use starlings_models::effect::library::{FAMILIES, stem};

/// What stands before the tables of the page.
const BEGIN: &str = "<!-- tables: written by models/tests/library_page.rs -->";

/// The tables of `docs/effects.md`, one per family.
fn tables() -> String {
    let mut text = String::new();
    for family in FAMILIES {
        let _ = write!(text, "\n## {}\n\n{}\n\n", family.title(), family.needs);
        text.push_str("| effect | what it says | where it enters | parameters | taken for | source |\n|---|---|---|---|---|---|\n");
        for effect in family.catalogue() {
            let adds: Vec<String> =
                effect.adds.iter().map(|add| format!("{}: `{}`", add.to, add.term)).collect();
            let parameters: Vec<String> = effect.parameters.iter().map(parameter).collect();
            let cells = [
                format!("`{}`", stem(&effect.name)),
                effect.says.clone(),
                adds.join("; "),
                parameters.join("; "),
                effect.confounders.join(", "),
                effect.source.clone(),
            ];
            let _ = writeln!(text, "| {} |", cells.map(|cell| cell.replace('|', "\\|")).join(" | "));
        }
    }
    text
}

fn parameter(parameter: &EffectParameter) -> String {
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" ({})", parameter.unit) };
    format!("`{}`{unit}: {}", parameter.name, parameter.range_text())
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the page of the effects is a file")]
fn the_page_of_effects_says_what_the_library_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/effects.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (head, rest) = page.split_once(BEGIN).expect("the page marks its tables");
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(path, format!("{head}{BEGIN}\n{}", tables())).unwrap();
        return;
    }
    assert_eq!(
        rest.trim(),
        tables().trim(),
        "write it again: STARLINGS_WRITE_PAGES=1 cargo test -p starlings-models --test library_page"
    );
}
