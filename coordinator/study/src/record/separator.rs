//! Recognises files that are no CSV with commas, a header and decimal points, as spreadsheets and loggers write them.
//!
//! Next file to read: [`super::csv`].

/// What separates the columns where it is not a comma, as text, and whether the numbers have decimal commas.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Foreign {
    pub(super) separator: &'static str,
    pub(super) decimal_commas: bool,
}

impl Foreign {
    /// Looks at the header and the row below it.
    pub(super) fn of(text: &str) -> Option<Self> {
        let mut lines = text.lines().filter(|line| !line.trim().is_empty());
        let (header, row) = (lines.next()?, lines.next().unwrap_or_default());
        let count = |separator: char| header.matches(separator).count();
        let by_sign = [(';', "semicolons"), ('\t', "tabs"), ('|', "vertical bars")];
        let sign = by_sign.into_iter().find(|(sign, _)| count(*sign) > count(','));
        let blanks = || {
            let cells = |line: &str| line.split_whitespace().count();
            let numbers = row.split_whitespace().all(|cell| cell.replace(',', ".").parse::<f64>().is_ok());
            let apart = !header.contains([',', '"']) && cells(header) > 1 && cells(header) == cells(row);
            (apart && numbers).then_some((' ', "blanks"))
        };
        let (sign, separator) = sign.or_else(blanks)?;
        let decimal_commas = row.split(sign).any(is_decimal_comma);
        Some(Self { separator, decimal_commas })
    }

    /// The remedy.
    pub(super) fn help(&self) -> String {
        let points = if self.decimal_commas { ", and points in the numbers (`0.5`, not `0,5`)" } else { "" };
        format!("save it with commas between the columns{points}")
    }
}

/// `0,5`: a number that has a comma in the place of its point.
pub(super) fn is_decimal_comma(cell: &str) -> bool {
    let cell = cell.trim().trim_matches('"');
    cell.matches(',').count() == 1 && cell.replace(',', ".").parse::<f64>().is_ok()
}

/// The kind of a file that is no text in UTF-8, judged by its first bytes, and the remedy.
pub(super) fn of_bytes(bytes: &[u8]) -> (&'static str, &'static str) {
    match bytes {
        [b'P', b'K', 3, 4, ..] => {
            ("is a spreadsheet or an archive (it begins as a ZIP file does)", "export the sheet as CSV")
        }
        [0xD0, 0xCF, 0x11, 0xE0, ..] => ("is a spreadsheet of an old kind", "export the sheet as CSV"),
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => ("is text in UTF-16", "save it as CSV in UTF-8"),
        _ => ("is not UTF-8 text", "save it as CSV in UTF-8"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Option<(&'static str, bool)> {
        Foreign::of(text).map(|foreign| (foreign.separator, foreign.decimal_commas))
    }

    #[test]
    fn the_separator_is_named_and_decimal_commas_are_seen() {
        assert_eq!(found("time;p\n0,5;1\n"), Some(("semicolons", true)));
        assert_eq!(found("time;p\n0.5;1\n"), Some(("semicolons", false)));
        assert_eq!(found("\ntime\tp\n0\t1\n"), Some(("tabs", false)));
        assert_eq!(found("time p\n0 1,5\n"), Some(("blanks", true)));
        assert_eq!(found("time;flow, mL/s;p\n0;1;2\n"), Some(("semicolons", false)));
    }

    #[test]
    fn commas_and_a_single_column_are_as_they_should_be() {
        for text in ["time,p\n0,1\n", "time, p\n0, 1\n", "t\n0\n", "\"a b\",c\n0,1\n", "a b\nx y\n", ""] {
            assert_eq!(found(text), None, "{text:?}");
        }
    }
}
