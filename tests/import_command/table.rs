//! Columns by name, and what stands between their rows.

use std::collections::BTreeMap;

/// Columns by name.
pub(crate) type Table = BTreeMap<String, Vec<f64>>;

/// The columns of a text with commas.
pub(crate) fn table(text: &str) -> Table {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, word) in columns.iter_mut().zip(line.split(',')) {
            column.push(word.parse().unwrap());
        }
    }
    names.into_iter().map(str::to_owned).zip(columns).collect()
}

/// A column between its rows.
pub(crate) fn at(table: &Table, name: &str, t: f64) -> f64 {
    let (times, values) =
        (&table["time"], table.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", table.keys())));
    let after = times.partition_point(|time| *time <= t).clamp(1, times.len() - 1);
    let part = ((t - times[after - 1]) / (times[after] - times[after - 1])).clamp(0.0, 1.0);
    (1.0 - part).mul_add(values[after - 1], part * values[after])
}
