//! Reading one TOML table field by field, with a place in the file for every value and every complaint.
//!
//! The tables are walked by hand and not through a derive: a derive stops at the first fault, and loses the place of a value
//! that may have several types. Next file to read: [`super::read`].

use starlings_models::nearest;
use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Named;
use crate::problem::{Source, suggestion};

/// A value of the file with its place.
pub(crate) type Node<'i> = Spanned<DeValue<'i>>;

/// One table, such as `[model]`, with the keys it may have.
pub(crate) struct Table<'a> {
    source: &'a Source,
    map: &'a DeTable<'a>,
    /// Where the table, or its header, stands.
    pub(crate) span: Range<usize>,
    /// What to call it in messages, such as `[model]`.
    name: String,
    /// Valid keys that an unknown key probably meant: their absence is not reported a second time.
    meant: RefCell<Vec<String>>,
}

impl<'a> Table<'a> {
    /// Opens a table and reports its unknown keys. Empty when the value is no table, which is reported.
    pub(crate) fn open(source: &'a Source, node: &'a Node<'a>, name: &str, keys: &[&str]) -> Option<Self> {
        let Some(map) = node.get_ref().as_table() else {
            wrong_type(source, node, name, "a table");
            return None;
        };
        Some(Self::from_map(source, map, node.span(), name, keys))
    }

    /// Opens a table whose map is at hand, as the file's root is.
    pub(crate) fn from_map(
        source: &'a Source,
        map: &'a DeTable<'a>,
        span: Range<usize>,
        name: &str,
        keys: &[&str],
    ) -> Self {
        let table = Self { source, map, span, name: name.to_owned(), meant: RefCell::default() };
        let valid: Vec<String> = keys.iter().map(|k| (*k).to_owned()).collect();
        for (key, _) in table.entries() {
            if !keys.contains(&key.get_ref().as_str()) {
                let message = format!("unknown key `{}` in {name}", key.get_ref());
                match suggestion(key.get_ref(), &valid) {
                    Some(help) => source.report_with(key.span(), message, help),
                    None => source.report(key.span(), message),
                }
                table.meant.borrow_mut().extend(nearest(key.get_ref(), &valid));
            }
        }
        table
    }

    /// Keys and values in the order of the file.
    pub(crate) fn entries(&self) -> Vec<(Spanned<String>, &'a Node<'a>)> {
        let mut entries: Vec<_> =
            self.map.iter().map(|(k, v)| (Spanned::new(k.span(), k.get_ref().to_string()), v)).collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
    }

    /// The value of a key.
    pub(crate) fn get(&self, key: &str) -> Option<&'a Node<'a>> {
        self.map.get(key)
    }

    /// Where a key stands, for complaints about its mere presence.
    pub(crate) fn key_span(&self, key: &str) -> Option<Range<usize>> {
        self.map.get_key_value(key).map(|(k, _)| k.span())
    }

    /// Reports that a required key is missing, unless a misspelt one was reported already.
    pub(crate) fn missing(&self, key: &str, expected: &str) {
        if !self.meant.borrow().iter().any(|m| m == key) {
            let message = format!("{} needs `{key}`: {expected}", self.name);
            self.source.report(self.span.clone(), message);
        }
    }

    /// Reports that a list, which must name something, names nothing.
    pub(crate) fn empty(&self, key: &str, help: &str) {
        let Some(node) = self.get(key) else { return };
        if node.get_ref().as_array().is_some_and(|list| list.is_empty()) {
            self.source.report_with(node.span(), format!("`{key}` of {} names nothing", self.name), help);
        }
    }

    /// A text.
    pub(crate) fn text(&self, key: &str) -> Option<Spanned<String>> {
        text(self.source, self.get(key)?, &format!("`{key}`"))
    }

    /// A text that must be there; empty when its absence was reported.
    pub(crate) fn required_text(&self, key: &str, expected: &str) -> Spanned<String> {
        if self.get(key).is_none() {
            self.missing(key, expected);
        }
        self.text(key).unwrap_or_else(|| Spanned::new(self.span.clone(), String::new()))
    }

    /// A finite number.
    pub(crate) fn number(&self, key: &str) -> Option<Spanned<f64>> {
        number(self.source, self.get(key)?, &format!("`{key}`"))
    }

    /// A whole number from 0.
    pub(crate) fn count(&self, key: &str) -> Option<Spanned<u64>> {
        let node = self.get(key)?;
        let parsed =
            node.get_ref().as_integer().and_then(|i| u64::from_str_radix(i.as_str(), i.radix()).ok());
        if parsed.is_none() {
            wrong_type(self.source, node, &format!("`{key}`"), "a whole number, not negative");
        }
        Some(Spanned::new(node.span(), parsed?))
    }

    /// `true` or `false`.
    pub(crate) fn flag(&self, key: &str) -> Option<Spanned<bool>> {
        let node = self.get(key)?;
        let Some(value) = node.get_ref().as_bool() else {
            wrong_type(self.source, node, &format!("`{key}`"), "`true` or `false`");
            return None;
        };
        Some(Spanned::new(node.span(), value))
    }

    /// The entries of a list; a value that is no list is reported.
    pub(crate) fn list(&self, key: &str) -> &'a [Node<'a>] {
        let Some(node) = self.get(key) else { return &[] };
        let Some(array) = node.get_ref().as_array() else {
            wrong_type(self.source, node, &format!("`{key}`"), "a list `[ ... ]`");
            return &[];
        };
        array
    }

    /// A list of texts.
    pub(crate) fn texts(&self, key: &str) -> Vec<Spanned<String>> {
        let what = format!("an entry of `{key}`");
        self.list(key).iter().filter_map(|node| text(self.source, node, &what)).collect()
    }

    /// A list of numbers.
    pub(crate) fn numbers(&self, key: &str) -> Vec<Spanned<f64>> {
        let what = format!("an entry of `{key}`");
        self.list(key).iter().filter_map(|node| number(self.source, node, &what)).collect()
    }

    /// Two numbers `[a, b]` with `a < b`, infinite ones allowed.
    pub(crate) fn interval(&self, key: &str) -> Option<Spanned<[f64; 2]>> {
        let node = self.get(key)?;
        let list = node.get_ref().as_array().map_or(&[][..], |l| l);
        let ends: Option<Vec<f64>> = list.iter().map(|n| any_number(n.get_ref())).collect();
        match ends.as_deref() {
            Some(&[a, b]) if a < b => Some(Spanned::new(node.span(), [a, b])),
            _ => {
                let message = format!("`{key}` must be two numbers `[a, b]` with a < b");
                self.source.report(node.span(), message);
                None
            }
        }
    }

    /// The tables of a list, opened one by one.
    pub(crate) fn tables(&self, key: &str, name: &str, keys: &[&str]) -> Vec<Table<'a>> {
        self.list(key).iter().filter_map(|node| Table::open(self.source, node, name, keys)).collect()
    }

    /// A table inside this one.
    pub(crate) fn table(&self, key: &str, name: &str, keys: &[&str]) -> Option<Table<'a>> {
        Table::open(self.source, self.get(key)?, name, keys)
    }

    /// A table with free keys, such as constants by name, in the order of the file.
    pub(crate) fn free_entries(&self, key: &str) -> Vec<(Spanned<String>, &'a Node<'a>)> {
        let Some(node) = self.get(key) else { return Vec::new() };
        let Some(map) = node.get_ref().as_table() else {
            wrong_type(self.source, node, &format!("`{key}`"), "a table `{ name = value }`");
            return Vec::new();
        };
        let keys: Vec<String> = map.keys().map(|k| k.get_ref().to_string()).collect();
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        Self::from_map(self.source, map, node.span(), key, &keys).entries()
    }
}

/// A text; `None` when a problem was reported.
pub(crate) fn text(source: &Source, node: &Node<'_>, what: &str) -> Option<Spanned<String>> {
    let Some(value) = node.get_ref().as_str() else {
        wrong_type(source, node, what, "a text in quotes");
        return None;
    };
    Some(Spanned::new(node.span(), value.to_owned()))
}

/// A finite number; `None` when a problem was reported.
pub(crate) fn number(source: &Source, node: &Node<'_>, what: &str) -> Option<Spanned<f64>> {
    let Some(value) = any_number(node.get_ref()).filter(|v| v.is_finite()) else {
        wrong_type(source, node, what, "a finite number");
        return None;
    };
    Some(Spanned::new(node.span(), value))
}

fn any_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(f) => f.as_str().parse().ok(),
        DeValue::Integer(i) if i.radix() == 10 => i.as_str().parse().ok(),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|v| v as f64),
        _ => None,
    }
}

/// Reports a value of the wrong type, with what it is.
pub(crate) fn wrong_type(source: &Source, node: &Node<'_>, what: &str, expected: &str) {
    let found = match node.get_ref() {
        DeValue::String(s) => format!("the text \"{s}\""),
        DeValue::Integer(i) => format!("the number {i}"),
        DeValue::Float(f) => format!("the number {f}"),
        DeValue::Boolean(b) => format!("`{b}`"),
        DeValue::Datetime(_) => "a date or time".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    };
    source.report(node.span(), format!("{what} must be {expected}, found {found}"));
}

/// Texts by name; a value that is no text is reported.
pub(crate) fn named_texts(source: &Source, entries: &[(Spanned<String>, &Node<'_>)]) -> Named<String> {
    let read = |(key, node): &(Spanned<String>, &Node<'_>)| {
        text(source, node, &format!("`{}`", key.get_ref())).map(|value| (key.clone(), value))
    };
    entries.iter().filter_map(read).collect()
}

/// The choice behind a word; an unknown word is reported.
pub(crate) fn choose<T: Copy>(
    source: &Source,
    word: Option<&Spanned<String>>,
    what: &str,
    choices: &[(&str, T)],
) -> Option<T> {
    let word = word?;
    let found = choices.iter().find(|(name, _)| name == word.get_ref()).map(|(_, choice)| *choice);
    if found.is_none() {
        let valid: Vec<String> = choices.iter().map(|(name, _)| (*name).to_owned()).collect();
        source.report_unknown(word.span(), format!("unknown {what} `{}`", word.get_ref()), &valid);
    }
    found
}
