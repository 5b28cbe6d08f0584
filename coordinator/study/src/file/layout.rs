//! The layout of a model: any table of the file as one value, and the way back from a path in it to a place in the file.
//!
//! What a layout may hold is checked by the model, whose errors hold a path such as `regions[2].to`. Next file to read:
//! [`crate::check::model`].

use std::ops::Range;

use serde_json::Value;
use toml::de::DeValue;

use super::table::{Node, wrong_type};
use crate::problem::Source;

/// A layout as it is written.
#[derive(Debug)]
pub(crate) struct Layout {
    /// What the model receives.
    pub(crate) value: Value,
    /// Paths of all parts with their places, outermost first.
    places: Vec<(String, Range<usize>)>,
}

impl Layout {
    /// Reads any value of the file; a number that is not finite is reported.
    pub(crate) fn read(source: &Source, node: &Node<'_>) -> Self {
        let mut places = Vec::new();
        let value = convert(source, node, "", &mut places);
        Self { value, places }
    }

    /// The place of a path, or of the nearest part around it.
    pub(crate) fn place(&self, path: &str) -> Option<Range<usize>> {
        let inside = |part: &str| {
            path.strip_prefix(part)
                .is_some_and(|rest| part.is_empty() || rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let around = self.places.iter().filter(|(part, _)| inside(part));
        around.max_by_key(|(part, _)| part.len()).map(|(_, span)| span.clone())
    }
}

fn convert(source: &Source, node: &Node<'_>, path: &str, places: &mut Vec<(String, Range<usize>)>) -> Value {
    places.push((path.to_owned(), node.span()));
    let what = || if path.is_empty() { "`layout`".to_owned() } else { format!("`{path}` in the layout") };
    let refused = |expected: &str| {
        wrong_type(source, node, &what(), expected);
        Value::Null
    };
    match node.get_ref() {
        DeValue::String(text) => Value::from(text.as_ref()),
        DeValue::Boolean(value) => Value::from(*value),
        DeValue::Array(items) => {
            let item = |(i, item): (usize, &Node<'_>)| convert(source, item, &format!("{path}[{i}]"), places);
            Value::Array(items.iter().enumerate().map(item).collect())
        }
        DeValue::Table(table) => {
            let entry = |(key, value): (&toml::Spanned<std::borrow::Cow<'_, str>>, &Node<'_>)| {
                let key = key.get_ref().to_string();
                let inner = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                let value = convert(source, value, &inner, places);
                (key, value)
            };
            Value::Object(table.iter().map(entry).collect())
        }
        DeValue::Integer(number) => {
            let text = number.as_str().replace('_', "");
            let value = i64::from_str_radix(&text, number.radix()).map(Value::from);
            value.unwrap_or_else(|_| refused("a number of at most 18 digits"))
        }
        DeValue::Float(number) => {
            let value = number.as_str().replace('_', "").parse::<f64>().ok().filter(|v| v.is_finite());
            value.map_or_else(|| refused("a finite number"), Value::from)
        }
        DeValue::Datetime(time) => Value::from(time.to_string()),
    }
}
