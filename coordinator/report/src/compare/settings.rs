//! Settings of studies that are not the same in all of them, as paths into their files.
//!
//! Of the text alone: what a default would be is not looked up, so a setting that one study spells out and another leaves to its
//! default is listed. Next file to read: [`super`].

use std::collections::BTreeMap;

use serde::Serialize;
use toml::Value;

/// A setting that differs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// Its path, such as `parameters.R.prior.median`; entries of a list go by their name, or by their number.
    pub path: String,
    /// Its value in every study; `null` where it is not set.
    pub values: Vec<Option<String>>,
}

/// The settings that differ, by path.
pub(super) fn differing(studies: &[&str]) -> Vec<Setting> {
    let mut all: BTreeMap<String, Vec<Option<String>>> = BTreeMap::new();
    for (k, text) in studies.iter().enumerate() {
        let mut leaves = Vec::new();
        // A study that ran is TOML; of a damaged text nothing is listed.
        if let Ok(table) = text.parse::<toml::Table>() {
            flatten("", &Value::Table(table), &mut leaves);
        }
        for (path, value) in leaves {
            all.entry(path).or_insert_with(|| vec![None; studies.len()])[k] = Some(value);
        }
    }
    let differs = |values: &Vec<Option<String>>| values.windows(2).any(|pair| pair[0] != pair[1]);
    all.into_iter().filter(|(_, v)| differs(v)).map(|(path, values)| Setting { path, values }).collect()
}

fn flatten(path: &str, value: &Value, leaves: &mut Vec<(String, String)>) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| flatten(&below(key), value, leaves)),
        Value::Array(list) if list.iter().any(Value::is_table) => {
            for (k, entry) in list.iter().enumerate() {
                let name = entry.get("name").and_then(Value::as_str);
                flatten(&below(&name.map_or_else(|| (k + 1).to_string(), str::to_owned)), entry, leaves);
            }
        }
        Value::String(text) => leaves.push((path.to_owned(), text.clone())),
        other => leaves.push((path.to_owned(), other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_a_list_go_by_their_names_whatever_their_order() {
        let one =
            "seed = 1\n[[parameters]]\nname = \"R\"\nfactor = 2\n[[parameters]]\nname = \"C\"\nfactor = 3\n";
        let two = "seed = 1\n[[parameters]]\nname = \"C\"\nfactor = 3\n[[parameters]]\nname = \"R\"\nfactor = 4.5\n[extra]\nx = [1, 2]\n";
        let setting = |path: &str, values: [Option<&str>; 2]| Setting {
            path: path.to_owned(),
            values: values.map(|v| v.map(str::to_owned)).into(),
        };
        let expected = [
            setting("extra.x", [None, Some("[1, 2]")]),
            setting("parameters.R.factor", [Some("2"), Some("4.5")]),
        ];
        assert_eq!(differing(&[one, two]), expected);
        assert_eq!(differing(&[one, one]), []);
    }
}
