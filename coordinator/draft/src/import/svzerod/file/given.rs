//! What drives a source, as a file writes it.
//!
//! Next file to read: [`super::super::signal`].

use serde::Deserialize;
use serde_json::{Map, Value};

use super::typed;

/// What drives a source: samples (or one number), or an expression of `t`.
#[derive(Debug)]
pub(in super::super) struct Given {
    pub(in super::super) t: Option<Vec<f64>>,
    pub(in super::super) values: Option<Vec<f64>>,
    pub(in super::super) function: Option<String>,
}

/// A number, or several.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number or a list of numbers")]
enum Numbers {
    One(f64),
    Several(Vec<f64>),
}

impl Given {
    /// Reads the values of a source, which have this key.
    pub(in super::super) fn read(place: &str, key: &str, value: &Value) -> Result<Self, String> {
        let mut given = Self { t: None, values: None, function: None };
        let entries: Map<String, Value> = typed(place, value)?;
        for (name, value) in &entries {
            let place = format!("{place}.{name}");
            match name.as_str() {
                "t" => given.t = Some(typed(&place, value)?),
                "fn" => given.function = Some(typed(&place, value)?),
                name if name == key => {
                    given.values = Some(match typed(&place, value)? {
                        Numbers::One(number) => vec![number],
                        Numbers::Several(numbers) => numbers,
                    });
                }
                _ => return Err(format!("{place}: unknown field `{name}`, expected `t`, `{key}` or `fn`")),
            }
        }
        Ok(given)
    }
}
