//! Numbers in tables: files of separated values with a heading, and columns of plain text.
//!
//! Next file to read: [`super::results`].

use starlings_models::{Signal, nearest};

use super::fault::{Fault, shape};

/// The name that a column of times has where the rule does not say.
const TIME: &str = "time";

/// How far a time may lie outside a table that is meant to reach it, relative to the table's times: programs add up steps.
const SLACK: f64 = 1e-9;

/// A file of separated values.
pub(super) struct Table {
    file: String,
    heading: Vec<String>,
    rows: Vec<csv::StringRecord>,
}

impl Table {
    /// Reads a table whose first line names the columns; the separator is a comma, else a semicolon, a tab or any number of blanks.
    pub(super) fn read(text: &str, file: &str) -> Result<Self, Fault> {
        if let Some((heading, rows)) = by_blanks(text) {
            return Ok(Self { file: file.to_owned(), heading, rows });
        }
        let first = text.lines().next().unwrap_or_default();
        let separator = [b',', b';', b'\t'].into_iter().find(|s| first.as_bytes().contains(s));
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator.unwrap_or(b','))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let wrong =
            |error: csv::Error| Fault::Unreadable { file: file.to_owned(), reason: error.to_string() };
        let heading = reader.headers().map_err(wrong)?;
        // Some programs mark the heading as a comment.
        let heading = heading.iter().map(|name| name.trim_start_matches('#').trim().to_owned()).collect();
        let rows = reader.records().collect::<Result<_, _>>().map_err(wrong)?;
        Ok(Self { file: file.to_owned(), heading, rows })
    }

    fn place(&self, column: &str) -> Result<usize, Fault> {
        self.heading.iter().position(|name| name == column).ok_or_else(|| Fault::NoColumn {
            file: self.file.clone(),
            column: column.to_owned(),
            nearest: nearest(column, &self.heading),
            known: self.heading.clone(),
        })
    }

    /// The numbers of a column.
    fn numbers(&self, column: &str) -> Result<Vec<f64>, Fault> {
        let place = self.place(column)?;
        let one = |(i, row): (usize, &csv::StringRecord)| {
            let text = row.get(place).unwrap_or_default();
            number(text).ok_or_else(|| Fault::NotNumber {
                file: self.file.clone(),
                place: format!("row {} in column `{column}`", i + 1),
                text: text.to_owned(),
            })
        };
        self.rows.iter().enumerate().map(one).collect()
    }

    /// The values of a column at `times`: by the column of times, or one row per time where there is none.
    fn column(&self, column: &str, time: Option<&str>, times: &[f64]) -> Result<Vec<f64>, Fault> {
        let time = time.or_else(|| self.heading.iter().map(String::as_str).find(|name| *name == TIME));
        let values = self.numbers(column)?;
        if let Some(time) = time {
            let samples = Signal { times: self.numbers(time)?, values };
            return self.sampled(&samples, time, times);
        }
        if values.len() == times.len() {
            return Ok(values);
        }
        let shape = format!("{}, or give the table a column `{TIME}`", shape(1, times.len()));
        Err(Fault::Length { file: self.file.clone(), expected: times.len(), got: values.len(), shape })
    }

    /// Linear between the rows; the value of a row itself where its time is asked for.
    fn sampled(&self, samples: &Signal, column: &str, times: &[f64]) -> Result<Vec<f64>, Fault> {
        let rows = &samples.times;
        if let Some(pair) = rows.windows(2).find(|pair| !matches!(pair, [a, b] if a < b)) {
            return Err(Fault::Times {
                file: self.file.clone(),
                column: column.to_owned(),
                before: pair[0],
                after: pair[1],
            });
        }
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            let shape = shape(1, times.len());
            return Err(Fault::Length { file: self.file.clone(), expected: times.len(), got: 0, shape });
        };
        let slack = SLACK * first.abs().max(last.abs());
        let value = |time: &f64| {
            if *time < first - slack || *time > last + slack {
                let file = self.file.clone();
                return Err(Fault::Uncovered { file, first: *first, last: *last, time: *time });
            }
            let at = rows.partition_point(|row| *row < time - slack);
            let hit = rows.get(at).is_some_and(|row| (row - time).abs() <= slack);
            Ok(if hit { samples.values[at] } else { samples.at(*time) })
        };
        times.iter().map(value).collect()
    }

    /// An output of `size` components at `times`, one time after the other; a field `wall` has the columns `wall[0]`, `wall[1]`.
    pub(super) fn output(
        &self,
        column: &str,
        time: Option<&str>,
        size: usize,
        times: &[f64],
    ) -> Result<Vec<f64>, Fault> {
        if size == 1 {
            return self.column(column, time, times);
        }
        let columns = (0..size).map(|i| self.column(&format!("{column}[{i}]"), time, times));
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        Ok((0..times.len()).flat_map(|j| columns.iter().map(move |column| column[j])).collect())
    }
}

/// Heading and rows of a table whose columns are separated by blanks: both lines that tell it have as many words.
///
/// Titles, comments after a `#` and a line of units may stand above the rows, and units in brackets in the heading.
fn by_blanks(text: &str) -> Option<(Vec<String>, Vec<csv::StringRecord>)> {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let is_comment = |line: &str| line.starts_with('#');
    let is_row =
        |line: &&str| !is_comment(line) && line.split_whitespace().any(|word| number(word).is_some());
    let begin = lines.iter().position(is_row).unwrap_or(lines.len());
    let n = lines.get(begin).map(|row| row.split_whitespace().count());
    let heading = |line: &str| -> Option<Vec<String>> {
        let words: Vec<String> = names(line.trim_start_matches('#')).map(str::to_owned).collect();
        (words.len() > 1 && n.is_none_or(|n| n == words.len())).then_some(words)
    };
    // Where no line names the columns without a `#`, the last of the comments does.
    let (comments, titles): (Vec<&str>, Vec<&str>) = lines[..begin].iter().partition(|line| is_comment(line));
    let heading =
        titles.into_iter().find_map(heading).or_else(|| comments.into_iter().rev().find_map(heading))?;
    let is_apart = |line: &str| !line.contains([',', ';', '\t', '"']);
    let rows = || lines[begin..].iter().filter(|line| !is_comment(line));
    (heading.iter().all(|word| is_apart(word)) && rows().next().is_none_or(|row| is_apart(row)))
        .then(|| (heading, rows().map(|line| line.split_whitespace().collect()).collect()))
}

/// The words of a heading but for units in brackets of their own.
fn names(heading: &str) -> impl Iterator<Item = &str> {
    let is_unit = |word: &&str| {
        [('[', ']'), ('(', ')')].iter().any(|(open, close)| word.starts_with(*open) && word.ends_with(*close))
    };
    heading.split_whitespace().filter(move |word| !is_unit(word))
}

/// Column `place` (from one) of the rows that hold nothing but numbers and reach that far.
pub(super) fn plain_column(text: &str, place: usize) -> Vec<f64> {
    let row = |line: &str| -> Option<f64> {
        let numbers = line.split_whitespace().map(number).collect::<Option<Vec<f64>>>()?;
        numbers.get(place - 1).copied()
    };
    text.lines().filter_map(row).collect()
}

/// A number as programs write it; Fortran's `1.0D-3` too.
pub(super) fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    text.parse().ok().or_else(|| {
        let starts = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        if starts { text.replace(['D', 'd'], "e").parse().ok() } else { None }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, column: &str, size: usize, times: &[f64]) -> Result<Vec<f64>, String> {
        let read = |table: Table| table.output(column, None, size, times);
        Table::read(text, "r.csv").and_then(read).map_err(|fault| fault.to_string())
    }

    #[test]
    fn a_table_without_times_has_one_row_per_time() {
        assert_eq!(of("tip\n1.5\n2.5\n", "tip", 1, &[0.0, 1.0]).unwrap(), [1.5, 2.5]);
        let says = of("tip\n1.5\n2.5\n", "tip", 1, &[0.0, 1.0, 2.0]).unwrap_err();
        assert!(says.contains("2 values where 3 belong"), "{says}");
    }

    #[test]
    fn a_table_with_times_is_read_between_its_rows() {
        let text = "time; tip\n0; 0\n0.1; NaN\n0.2; 4\n0.4; 8\n";
        assert_eq!(of(text, "tip", 1, &[0.2, 0.3, 0.4]).unwrap(), [4.0, 6.0, 8.0]);
        // 0.1 + 0.2 is a rounding error above 0.3; a row at 0.30000000000000004 is the row of that time.
        let summed = format!("time,tip\n0,0\n{},7\n", 0.1 + 0.2);
        assert_eq!(of(&summed, "tip", 1, &[0.3]).unwrap(), [7.0]);
        assert!(of(text, "tip", 1, &[0.5]).unwrap_err().contains("covers the times 0 to 0.4"));
        assert!(of("time,tip\n1,0\n1,2\n", "tip", 1, &[1.0]).unwrap_err().contains("do not increase"));
    }

    #[test]
    fn columns_may_stand_apart_by_blanks() {
        let text = "#  time      tip   load\n   0.0   1.0D-1     10\n\n   1.0   3.0D-1     10\n";
        assert_eq!(of(text, "tip", 1, &[0.0, 0.5, 1.0]).unwrap(), [0.1, 0.2, 0.3]);
        let says = of(text, "tpi", 1, &[0.0]).unwrap_err();
        assert_eq!(says, "r.csv has no column `tpi`; it has time, tip, load; did you mean `tip`?");
        // What stands above the heading, a line of units below it and units in it are no names.
        let text = "# my program 3\n# units s K\nZeit Temp\n0 293.0\n1 294.0\n";
        assert_eq!(of(text, "Temp", 1, &[0.0, 1.0]).unwrap(), [293.0, 294.0]);
        let text = "Zeit [s]  Temp [K]\n0 293.0\n1 294.0\n# done\n";
        assert_eq!(of(text, "Temp", 1, &[0.0, 1.0]).unwrap(), [293.0, 294.0]);
        let text = "results of a run\ntime tip\ns mm\n0 1\n1 2\n";
        assert_eq!(of(text, "tip", 1, &[0.5]).unwrap(), [1.5]);
        let says = of("time tip\n0 ****\n1 2\n", "tip", 1, &[0.5]).unwrap_err();
        assert!(says.contains("`****`"), "{says}");
        // A heading of two words above one column is one name.
        assert_eq!(of("tip load\n1.5\n2.5\n", "tip load", 1, &[0.0, 1.0]).unwrap(), [1.5, 2.5]);
    }

    #[test]
    fn a_field_has_one_column_per_component() {
        let text = "# wall[0],wall[1]\n1,2\n3,4\n5,6\n";
        assert_eq!(of(text, "wall", 2, &[0.0, 1.0, 2.0]).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn a_missing_column_and_a_word_are_said_with_their_place() {
        let says = of("time,tpi\n0,1\n", "tip", 1, &[0.0]).unwrap_err();
        assert_eq!(says, "r.csv has no column `tip`; it has time, tpi; did you mean `tpi`?");
        let says = of("tip\n1\nfailed\n", "tip", 1, &[0.0, 1.0]).unwrap_err();
        assert_eq!(says, "`failed` at row 2 in column `tip` of r.csv is not a number");
    }

    #[test]
    fn rows_of_words_are_no_rows_of_a_plain_column() {
        let text =
            " displacements for set TIP at 0.1\n\n  27  1.0D-03 -2.5E+00\n end\n  27  2.0D-03 -5.0E+00\n 1\n";
        assert_eq!(plain_column(text, 2), [1e-3, 2e-3]);
        assert_eq!(plain_column(text, 3), [-2.5, -5.0]);
    }
}
