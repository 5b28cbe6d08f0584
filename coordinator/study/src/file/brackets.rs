//! `[parameters]` where `[[parameters]]` is meant: a common mistake in TOML.
//!
//! TOML itself would complain about every key that then stands twice. Next file to read: [`super::read`].

use std::ops::Range;

use toml::de::{DeTable, DeValue};

use crate::problem::Source;

/// The lists of a study, by their path from the root.
const LISTS: [&str; 4] = ["parameters", "records", "effects", "model.states"];

/// Reports every list that is written as a table, once; whether there was one. `spoilt`: the text is no TOML.
pub(super) fn report(source: &Source, root: &DeTable<'_>, spoilt: bool) -> bool {
    let mut any = false;
    for name in LISTS {
        if !spoilt && !is_table(root, name) {
            continue;
        }
        let headers = headers(&source.text, name);
        let Some(first) = headers.first() else { continue };
        any = true;
        let others: Vec<String> = headers[1..].iter().map(|(line, _)| line.to_string()).collect();
        let also = match others.as_slice() {
            [] => String::new(),
            [one] => format!(", and so in line {one}"),
            [most @ .., last] => format!(", and so in lines {} and {last}", most.join(", ")),
        };
        source.report_with(
            first.1.clone(),
            format!("`[{name}]` is one table, where a study has a list of them"),
            format!("write `[[{name}]]`, with two brackets{also}"),
        );
    }
    any
}

fn is_table(root: &DeTable<'_>, name: &str) -> bool {
    let (first, rest) = name.split_once('.').map_or((name, None), |(first, rest)| (first, Some(rest)));
    let value = root.get(first).map(toml::Spanned::get_ref);
    match (value, rest) {
        (Some(DeValue::Table(inner)), Some(rest)) => is_table(inner, rest),
        (value, None) => matches!(value, Some(DeValue::Table(_))),
        _ => false,
    }
}

/// Lines (from 1) that are nothing but this header in single brackets, with the bytes of the header.
fn headers(text: &str, name: &str) -> Vec<(usize, Range<usize>)> {
    let mut at = 0;
    let mut found = Vec::new();
    for (i, line) in text.split_inclusive('\n').enumerate() {
        let bare = line.split('#').next().unwrap_or_default().trim();
        let inside = bare.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        if inside.is_some_and(|inside| inside.split('.').map(str::trim).eq(name.split('.'))) {
            let start = at + line.find('[').unwrap_or_default();
            found.push((i + 1, start..start + bare.len()));
        }
        at += line.len();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_in_single_brackets_are_found_with_their_lines() {
        let text = "[study]\n [ parameters ] # one\nname = \"[parameters]\"\n[[parameters]]\n[parameters]\n";
        let found = headers(text, "parameters");
        assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [2, 5]);
        assert_eq!(&text[found[0].1.clone()], "[ parameters ]");
        assert_eq!(headers("[model . states]\n", "model.states").len(), 1);
    }
}
