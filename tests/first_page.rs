//! The first pages of the book, done as they say.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod page_kit;

use page_kit::{blocks, follow, page, quotations};

#[test]
fn a_newcomer_learns_in_the_order_of_the_first_page_and_sees_what_it_shows() {
    follow(&page("start.md"), tempfile::tempdir().unwrap().path());
}

#[test]
fn a_program_in_c_becomes_a_model_as_its_page_says() {
    follow(&page("c-and-fortran.md"), tempfile::tempdir().unwrap().path());
}

#[test]
fn what_pages_quote_of_examples_stands_there() {
    let quoted: usize = ["an-fmu.md", "coming-from.md"].into_iter().map(|name| quotations(&page(name))).sum();
    assert!(quoted > 1, "only {quoted} quotations: are they still recognised?");
}

/// What the worker's side knows, of which the page says that it is all.
#[test]
fn the_page_of_programs_names_every_variable_of_a_template_and_every_rule() {
    let page = page("c-and-fortran.md");
    let source = |file: &str| {
        let path = common::repository("worker/solver/src/adapter/command").join(file);
        std::fs::read_to_string(path).unwrap()
    };
    let listed = |text: &str, name: &str| -> Vec<String> {
        let list = text.split(name).nth(1).and_then(|rest| rest.split(']').nth(1)).unwrap();
        list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
    };
    let names = listed(&source("template.rs"), "const OWN_NAMES");
    let placeholders = listed(&source("request.rs"), "const OWN");
    assert!(names.len() > 6 && placeholders.len() > 3, "{names:?} {placeholders:?}");
    for name in names {
        assert!(page.contains(&format!("`{name}")), "the page does not say `{name}`");
    }
    for name in placeholders {
        assert!(page.contains(&format!("`{{{name}}}`")), "the page does not say `{{{name}}}`");
    }
    for rule in ["json", "csv", "column", "regex"] {
        assert!(page.contains(&format!("| `{rule}")), "the page has no rule `{rule}`");
    }
    assert!(blocks(&page).iter().any(|block| block.text().contains("read = \"csv:")));
}
