//! What separates the columns of a file, found by trying: the sign with which most cells are values.
//!
//! Next file to read: [`super::sheet`].

use super::cells::{is_missing, is_value};

/// What stands between two columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// One sign.
    Sign(u8),
    /// Any number of blanks.
    Blanks,
}

/// All of them; where two do equally well, the first.
const ALL: [Separator; 5] = [
    Separator::Sign(b';'),
    Separator::Sign(b'\t'),
    Separator::Sign(b','),
    Separator::Sign(b'|'),
    Separator::Blanks,
];

/// The separator of lines, without any a comma.
pub(super) fn separator_of(lines: &[&str]) -> Separator {
    let mut best = (Separator::Sign(b','), 0.0);
    for separator in ALL {
        let rows: Vec<Vec<String>> =
            lines.iter().filter_map(|line| separator.cut(std::slice::from_ref(line)).ok()?.pop()).collect();
        let width = rows.iter().map(Vec::len).max().unwrap_or(0);
        if width < 2 {
            continue;
        }
        let values = |row: &Vec<String>| row.iter().filter(|cell| is_value(cell) || is_missing(cell)).count();
        let share =
            |row: &Vec<String>| if row.len() < 2 { 0.0 } else { values(row) as f64 / row.len() as f64 };
        let score = rows.iter().map(share).sum::<f64>() / lines.len() as f64;
        if score > best.1 {
            best = (separator, score);
        }
    }
    best.0
}

impl Separator {
    /// Whether it is the one that a study reads.
    pub(super) fn is_comma(self) -> bool {
        self == Self::Sign(b',')
    }

    /// Its name.
    pub(super) fn says(self) -> &'static str {
        match self {
            Self::Sign(b';') => "semicolons",
            Self::Sign(b'\t') => "tabs",
            Self::Sign(b'|') => "vertical bars",
            Self::Sign(_) => "commas",
            Self::Blanks => "blanks",
        }
    }

    /// Cuts lines into cells.
    ///
    /// # Errors
    /// When quotes do not fit together.
    pub(super) fn cut(self, lines: &[&str]) -> Result<Vec<Vec<String>>, String> {
        let Self::Sign(sign) = self else {
            let cells =
                |line: &&str| line.split_whitespace().map(|cell| cell.trim_matches('"').to_owned()).collect();
            return Ok(lines.iter().map(cells).collect());
        };
        let mut reader = csv::ReaderBuilder::new();
        reader.has_headers(false).flexible(true).trim(csv::Trim::All).delimiter(sign);
        let text = lines.join("\n");
        let rows = reader.from_reader(text.as_bytes()).into_records().map(|row| {
            let row = row.map_err(|error| format!("this is no table: {error}"))?;
            Ok(row.iter().map(ToOwned::to_owned).collect())
        });
        rows.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_sign_with_which_most_cells_are_values() {
        let of = |text: &str| separator_of(&text.lines().collect::<Vec<_>>()).says();
        assert_eq!(of("time,p\n0,1\n1,2"), "commas");
        assert_eq!(of("time;p\n0,5;1,5\n1,5;2"), "semicolons");
        assert_eq!(of("time;p\n2024-01-05 12:00:00;1,5"), "semicolons");
        assert_eq!(of("time\tflow, mL/s\n0\t1"), "tabs");
        assert_eq!(of("t p q\n0 1 2\n1   2 3"), "blanks");
        assert_eq!(of("t, p\n0, 1.5\n1, 2.5"), "commas");
        assert_eq!(of("p\n1\n2"), "commas");
    }
}
