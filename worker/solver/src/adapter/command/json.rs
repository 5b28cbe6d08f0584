//! JSON as programs write it, and the numbers of an output in it.
//!
//! Many languages write numbers that are not finite as bare `NaN` and `Infinity`, which JSON does not have; they are read as
//! `null`, which is NaN here. Next file to read: [`super::results`].

use serde_json::Value;
use starlings_models::nearest;

use super::fault::{Fault, shape};

/// Reads a document; of a text that is none, its last line, since programs talk before they answer.
///
/// # Errors
/// When neither is JSON.
pub(in super::super) fn document(text: &str) -> Result<Value, serde_json::Error> {
    read(text).or_else(|error| {
        let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
        // The error of the whole text is the one that helps.
        if last.trim_start().starts_with('{') { read(last).map_err(|_| error) } else { Err(error) }
    })
}

fn read(text: &str) -> Result<Value, serde_json::Error> {
    serde_json::from_str(text).or_else(|error| match without_bare_words(text) {
        Some(text) => serde_json::from_str(&text),
        None => Err(error),
    })
}

/// The text with `NaN`, `Infinity` and `-Infinity` outside strings as `null`; none when there are none.
fn without_bare_words(text: &str) -> Option<String> {
    let mut out = String::with_capacity(text.len());
    let (mut rest, mut in_string, mut changed) = (text, false, false);
    while let Some(letter) = rest.chars().next() {
        let word = ["-Infinity", "Infinity", "NaN"].into_iter().find(|word| rest.starts_with(word));
        if let (Some(word), false) = (word, in_string) {
            out.push_str("null");
            rest = &rest[word.len()..];
            changed = true;
            continue;
        }
        // An escaped letter never ends a string.
        let taken = if in_string && letter == '\\' {
            rest.chars().take(2).map(char::len_utf8).sum()
        } else {
            letter.len_utf8()
        };
        in_string ^= letter == '"';
        out.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    changed.then_some(out)
}

/// The value that keys lead to.
pub(super) fn at<'a>(document: &'a Value, keys: &[String], file: &str) -> Result<&'a Value, Fault> {
    keys.iter().try_fold(document, |value, key| {
        let inside = match value {
            Value::Object(map) => map.get(key),
            Value::Array(list) => key.parse::<usize>().ok().and_then(|i| list.get(i)),
            _ => None,
        };
        inside.ok_or_else(|| {
            let known: Vec<String> = value.as_object().into_iter().flat_map(|m| m.keys().cloned()).collect();
            Fault::NoKey { file: file.to_owned(), key: keys.join("."), nearest: nearest(key, &known), known }
        })
    })
}

/// The numbers of an output: one, one per time, or for a field one list per time.
pub(super) fn numbers(value: &Value, size: usize, n_times: usize, file: &str) -> Result<Vec<f64>, Fault> {
    let wrong = |got: usize, expected: usize| Fault::Length {
        file: file.to_owned(),
        expected,
        got,
        shape: shape(size, n_times),
    };
    let Value::Array(list) = value else {
        return if size * n_times == 1 {
            Ok(vec![number(value, file)?])
        } else {
            Err(wrong(1, size * n_times))
        };
    };
    if !list.iter().any(Value::is_array) {
        // A field at several times as one list would leave open which index runs first.
        if list.len() != size * n_times || (size > 1 && n_times > 1) {
            return Err(wrong(list.len(), size * n_times));
        }
        return list.iter().map(|item| number(item, file)).collect();
    }
    if list.len() != n_times {
        return Err(wrong(list.len(), n_times));
    }
    let mut all = Vec::with_capacity(size * n_times);
    for row in list {
        let row = row.as_array().map_or(std::slice::from_ref(row), Vec::as_slice);
        if row.len() != size {
            return Err(wrong(row.len(), size));
        }
        for item in row {
            all.push(number(item, file)?);
        }
    }
    Ok(all)
}

fn number(value: &Value, file: &str) -> Result<f64, Fault> {
    let wrong = || Fault::NotNumber {
        file: file.to_owned(),
        place: "a value".to_owned(),
        text: value.to_string().chars().take(40).collect(),
    };
    if value.is_null() { Ok(f64::NAN) } else { value.as_f64().ok_or_else(wrong) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, size: usize, n_times: usize) -> Result<Vec<f64>, String> {
        numbers(&document(text).unwrap(), size, n_times, "out.json").map_err(|fault| fault.to_string())
    }

    #[test]
    fn a_number_a_list_and_a_list_of_lists_are_read_by_the_shape_of_the_output() {
        assert_eq!(of("3.5", 1, 1).unwrap(), [3.5]);
        assert_eq!(of("[1, 2, 3]", 1, 3).unwrap(), [1.0, 2.0, 3.0]);
        assert_eq!(of("[1, 2, 3]", 3, 1).unwrap(), [1.0, 2.0, 3.0]);
        assert_eq!(of("[[1, 2], [3, 4], [5, 6]]", 2, 3).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn a_wrong_shape_is_said_with_what_belongs() {
        assert!(of("3.5", 1, 2).unwrap_err().contains("1 value where 2 belong"));
        assert!(of("[1, 2, 3]", 1, 2).unwrap_err().contains("one for each of the 2 times"));
        assert!(of("[[1, 2, 3], [4, 5, 6]]", 2, 3).is_err(), "one list per component is not one per time");
        assert!(of("[1, 2, 3, 4]", 2, 2).is_err(), "a flat list leaves the order open");
        assert!(of("[1, \"two\"]", 1, 2).unwrap_err().contains("not a number"));
    }

    #[test]
    fn words_that_json_does_not_have_are_nan_and_strings_stay() {
        let value = document(r#"{"a": [NaN, -Infinity, 1e3], "says": "NaN \" NaN"}"#).unwrap();
        assert_eq!(value["says"], "NaN \" NaN");
        assert!(numbers(&value["a"], 1, 3, "-").unwrap()[..2].iter().all(|v| v.is_nan()));
    }

    #[test]
    fn a_document_after_other_lines_is_the_last_of_them() {
        assert_eq!(document("step 1\nstep 2\n{\"a\": 1}\n").unwrap()["a"], 1);
        assert!(document("step 1\nstep 2\n").is_err());
    }

    #[test]
    fn keys_lead_into_objects_and_lists() {
        let value = document(r#"{"a": {"b": [10, 20]}}"#).unwrap();
        let keys = |text: &str| text.split('.').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(at(&value, &keys("a.b.1"), "-").unwrap(), 20);
        let says = at(&value, &keys("a.c"), "out.json").unwrap_err().to_string();
        assert_eq!(says, "out.json has no key `a.c`; it has b");
    }
}
