//! What a cell holds: a number, a moment, or nothing.
//!
//! Next file to read: [`super::moment`].

use super::moment::Moment;

/// What programs write where a value is missing.
const MISSING: [&str; 14] =
    ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---", "?", ".", "inf", "-inf"];

/// Whether a cell says that there is no value.
pub(super) fn is_missing(cell: &str) -> bool {
    MISSING.contains(&cell.trim().to_ascii_lowercase().as_str())
}

/// The finite number of a cell, with a decimal point or comma.
pub(super) fn number(cell: &str) -> Option<f64> {
    let cell = cell.trim();
    // `5.` and `5,` alone would make a list of numbers one number.
    let decimal = |sign: char| {
        let (before, after) = cell.split_once(sign)?;
        let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        let fits = digit(after.chars().next())
            && (before.is_empty() || digit(before.chars().last()) || before == "-");
        fits.then(|| format!("{before}.{after}"))
    };
    let text = if cell.contains(',') { decimal(',')? } else { cell.to_owned() };
    if !text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        return None;
    }
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// Whether a cell is a number.
pub(super) fn is_number(cell: &str) -> bool {
    number(cell).is_some()
}

/// Whether a cell is a number or a moment.
pub(super) fn is_value(cell: &str) -> bool {
    is_number(cell) || Moment::is(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_or_a_comma_and_lists_are_none() {
        assert_eq!(number("0,5"), Some(0.5));
        assert_eq!(number(" -1.5e-3 "), Some(-1.5e-3));
        assert_eq!(number("-0,5"), Some(-0.5));
        for text in ["0,", "1,2,3", "a,5", "nan", "inf", "", "12:00", "infinity"] {
            assert_eq!(number(text), None, "{text}");
        }
    }

    #[test]
    fn a_gap_has_many_names() {
        assert!(["", "NaN", " n/a", "#N/A", "-"].into_iter().all(is_missing));
        assert!(!["0", "x", "-1"].into_iter().any(is_missing));
    }
}
