//! What differs between two texts of a study file, in the words of the file.
//!
//! Only for messages: whether a difference changes a number is known from [`super::meaning`].

use std::collections::BTreeMap;

use toml::{Table, Value};

/// Beginnings of keys that change no number of a run.
const WITHOUT_EFFECT: [&str; 12] = [
    "fleet.",
    "spectrum.",
    "study.name",
    "study.says",
    "model.address",
    "model.command",
    "model.environment",
    "model.folder",
    "model.memory",
    "model.pin",
    "model.ranks",
    "model.start_timeout",
];

/// Differences that are named at most; the first ones show what matters.
const SHOWN: usize = 6;

/// The keys that may change a number and differ, each as `key` from … to …; empty where both differ in order only.
pub(super) fn changes(before: &str, now: &str) -> Vec<String> {
    let (Ok(before), Ok(now)) = (before.parse::<Table>(), now.parse::<Table>()) else { return Vec::new() };
    let (before, now) = (flat(before), flat(now));
    let mut told = Vec::new();
    for key in before.keys().chain(now.keys().filter(|key| !before.contains_key(*key))) {
        let (was, is) = (before.get(key), now.get(key));
        if was == is || WITHOUT_EFFECT.iter().any(|start| key.starts_with(start)) {
            continue;
        }
        let shown = |value: Option<&String>| value.cloned().unwrap_or_else(|| "nothing".to_owned());
        told.push(format!("`{key}` from {} to {}", shown(was), shown(is)));
    }
    let more = told.len().saturating_sub(SHOWN);
    told.truncate(SHOWN);
    if more > 0 {
        told.push(format!("and {more} more"));
    }
    told
}

/// Every value of a table by its path, such as `parameters[R].prior.median`.
fn flat(table: Table) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    for (key, value) in table {
        gather(key, value, &mut values);
    }
    values
}

fn gather(path: String, value: Value, values: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                gather(format!("{path}.{key}"), value, values);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_table) => {
            let labels: Vec<String> = items.iter().enumerate().map(|(i, item)| label(i, item)).collect();
            // Their order decides the order of the estimated vector.
            values.insert(path.clone(), labels.join(", "));
            for (label, item) in labels.into_iter().zip(items) {
                gather(format!("{path}[{label}]"), item, values);
            }
        }
        // 1 and 1.0 are the same number.
        Value::Integer(number) if number.unsigned_abs() < 1 << 53 => {
            values.insert(path, format!("{}", number as f64));
        }
        Value::Float(number) => {
            values.insert(path, format!("{number}"));
        }
        other => {
            values.insert(path, other.to_string());
        }
    }
}

/// The name of an entry, or else its number.
fn label(index: usize, item: &Value) -> String {
    let word = |key: &str| item.get(key).and_then(Value::as_str).map(str::to_owned);
    word("name").or_else(|| word("output")).unwrap_or_else(|| (index + 1).to_string())
}

#[cfg(test)]
mod tests {
    use super::changes;

    const STUDY: &str = "[study]\nname = 'a'\n[[parameters]]\nname = 'R'\nprior = { median = 3.0, factor = 2 }\n\
                         [[parameters]]\nname = 'C'\n[estimator]\npasses = 2\n[fleet]\nworkers = 2\n";

    #[test]
    fn a_changed_number_is_told_with_its_key_and_both_values() {
        let now = STUDY.replace("median = 3.0", "median = 4.5").replace("workers = 2", "workers = 8");
        assert_eq!(changes(STUDY, &now), ["`parameters[R].prior.median` from 3 to 4.5"]);
        let now = STUDY.replace("passes = 2\n", "");
        assert_eq!(changes(STUDY, &now), ["`estimator.passes` from 2 to nothing"]);
    }

    #[test]
    fn comments_layout_and_another_way_to_write_a_number_are_no_change() {
        let now =
            format!("# a thought\n{}", STUDY.replace("factor = 2 ", "factor = 2.0").replace("'a'", "\"a\""));
        assert_eq!(changes(STUDY, &now), Vec::<String>::new());
    }

    #[test]
    fn another_order_of_the_parameters_is_a_change() {
        let (head, tail) = STUDY.split_at(STUDY.find("[[").expect("it has parameters"));
        let now = head.to_owned() + &tail.replace("'R'", "'x'").replace("'C'", "'R'").replace("'x'", "'C'");
        assert_eq!(changes(STUDY, &now)[0], "`parameters` from R, C to C, R");
    }
}
