//! Name and unit in the heading of a column: `pressure (mmHg)`, `flow [mL/s]`, `T / K`, `p_mmHg`.
//!
//! Next file to read: [`super::recording`].

use starlings_models::units::Unit;

/// Words for the time, in lower case.
const TIMES: [&str; 12] = [
    "time",
    "times",
    "timestamp",
    "datetime",
    "date",
    "zeit",
    "seconds",
    "sec",
    "clock",
    "date/time",
    "date time",
    "elapsed",
];

/// Name and unit of a heading; without a unit an empty text.
pub(super) fn name_and_unit(heading: &str) -> (String, String) {
    let heading = heading.trim();
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}'), ('<', '>')] {
        let inside = heading.strip_suffix(close).and_then(|rest| rest.rsplit_once(open));
        // `wall[3]` is a component and no unit.
        if let Some((name, unit)) =
            inside.filter(|(name, unit)| !name.trim().is_empty() && unit.parse::<u64>().is_err())
        {
            return (name.trim().to_owned(), label(unit));
        }
    }
    if let Some((name, unit)) = heading.split_once(" / ").or_else(|| heading.split_once(" in "))
        && Unit::parse(unit.trim()).is_some()
    {
        return (name.trim().to_owned(), label(unit));
    }
    if let Some((name, unit)) = heading.split_once(',').filter(|(_, unit)| Unit::parse(unit.trim()).is_some())
    {
        return (name.trim().to_owned(), label(unit));
    }
    // One letter behind `_` is more often an index than a unit, but for the time.
    if let Some((name, unit)) = heading.rsplit_once('_') {
        let is_unit = Unit::parse(unit).is_some() && unit.parse::<f64>().is_err();
        if is_unit && (unit.len() > 1 || is_time(name)) {
            return (name.to_owned(), label(unit));
        }
    }
    (heading.to_owned(), String::new())
}

/// A unit as a label: `-` and `1` are none.
pub(super) fn label(unit: &str) -> String {
    let bare = unit.trim().trim_matches(['(', ')', '[', ']']).trim();
    if matches!(bare, "-" | "1" | "") { String::new() } else { bare.to_owned() }
}

/// Whether a name is a word for the time.
pub(super) fn is_time(name: &str) -> bool {
    // A capital T is a temperature.
    name.trim() == "t" || TIMES.contains(&name.trim().to_lowercase().as_str())
}

/// The name of a unit of time in a study, of the ways in which people write it.
pub(super) fn time_unit(unit: &str) -> Option<&'static str> {
    Some(match unit.trim().to_lowercase().as_str() {
        "s" | "sec" | "secs" | "second" | "seconds" => "s",
        "ms" | "msec" | "millisecond" | "milliseconds" => "ms",
        "us" | "µs" | "μs" | "microseconds" => "us",
        "min" | "mins" | "minute" | "minutes" => "min",
        "h" | "hr" | "hrs" | "hour" | "hours" => "h",
        "d" | "day" | "days" => "d",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_many_names_and_a_capital_t_is_none() {
        assert!(["time", "t", "Zeit", "Date/Time"].into_iter().all(is_time));
        assert!(!["T", "temperature", "x"].into_iter().any(is_time));
    }

    #[test]
    fn units_are_found_in_headings_and_indices_are_none() {
        for (heading, name, unit) in [
            ("pressure (mmHg)", "pressure", "mmHg"),
            ("flow [mL/s]", "flow", "mL/s"),
            ("T / K", "T", "K"),
            ("velocity in m/s", "velocity", "m/s"),
            ("flow, mL/s", "flow", "mL/s"),
            ("p_mmHg", "p", "mmHg"),
            ("time_s", "time", "s"),
            ("x_1", "x_1", ""),
            ("wall[3]", "wall[3]", ""),
            ("ratio (-)", "ratio", ""),
            ("k_c", "k_c", ""),
            ("(note)", "(note)", ""),
            ("p/p0", "p/p0", ""),
        ] {
            assert_eq!(name_and_unit(heading), (name.to_owned(), unit.to_owned()), "{heading}");
        }
    }
}
