//! A recording: times that increase, and columns of numbers with names and units.
//!
//! Next file to read: [`super::roles`].

use std::path::{Path, PathBuf};

use super::Ask;
use super::cells::{is_missing, number};
use super::header::{label, name_and_unit, time_unit};
use super::row_numbers::numbers_rows;
use super::sheet::{Sheet, sheet};
use super::times::{TimeWish, Times, time_column, times};
use crate::names::Names;

/// What one file holds.
#[derive(Debug)]
pub(super) struct Recording {
    /// Where it was read.
    pub(super) file: PathBuf,
    /// Heading of the column of times in the file that the study reads.
    pub(super) time: String,
    /// Unit of the times where the file says it.
    pub(super) time_unit: Option<String>,
    /// Increasing.
    pub(super) times: Vec<f64>,
    /// All other columns of numbers.
    pub(super) columns: Vec<Column>,
    /// One sentence each.
    pub(super) notes: Vec<String>,
    /// Whether the study can read the file as it is.
    pub(super) as_it_is: bool,
}

/// A column of numbers; a gap is NaN.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// Heading in the file that the study reads.
    pub(super) heading: String,
    /// Name, letters, digits and `_`.
    pub(super) name: String,
    /// Unit of the heading; empty where it has none.
    pub(super) unit: String,
    /// Values at the times.
    pub(super) values: Vec<f64>,
}

/// Reads a file.
///
/// # Errors
/// One sentence with a remedy.
pub(super) fn recording(file: &Path, wish: &TimeWish<'_>, ask: Ask<'_>) -> Result<Recording, String> {
    let bytes = std::fs::read(file).map_err(|error| format!("cannot be read: {error}"))?;
    let mut sheet = sheet(&bytes)?;
    let (time, times) = if let Some(step) = wish.step {
        sheet.plain = false;
        (None, Times::counted(sheet.rows.len(), step))
    } else {
        let column = time_column(&sheet, wish.column, ask)?;
        (Some(column), times(&mut sheet, column)?)
    };
    let mut notes = std::mem::take(&mut sheet.notes);
    let skipped: Vec<usize> = time.into_iter().chain(times.clock).collect();
    let columns = columns(&sheet, &skipped, &mut notes);
    let used: Vec<usize> = time.into_iter().chain(columns.iter().map(|(at, _)| *at)).collect();
    let heading = time
        .filter(|_| !times.of_dates && sheet.is_as_a_study_reads(&used))
        .map(|at| sheet.headers[at].clone());
    let unit = time.filter(|_| !times.of_dates).map(|at| unit_of(&sheet, at)).filter(|unit| !unit.is_empty());
    let unit = unit.map(|unit| time_unit(&unit).map_or(unit, ToOwned::to_owned));
    let mut found = Recording {
        file: file.to_owned(),
        as_it_is: heading.is_some(),
        time: heading.unwrap_or_else(|| "time".to_owned()),
        time_unit: if times.of_dates { Some("s".to_owned()) } else { unit },
        times: times.values,
        columns: columns.into_iter().map(|(_, column)| column).collect(),
        notes,
    };
    found.put_in_order()?;
    found.give_clean_headings();
    Ok(found)
}

impl Recording {
    /// Sorts the rows, and leaves out those without a time of their own.
    fn put_in_order(&mut self) -> Result<(), String> {
        let mut order: Vec<usize> =
            (0..self.times.len()).filter(|row| self.times[*row].is_finite()).collect();
        let without = self.times.len() - order.len();
        let sorted = order.windows(2).all(|pair| self.times[pair[0]] <= self.times[pair[1]]);
        order.sort_by(|a, b| self.times[*a].total_cmp(&self.times[*b]));
        let before = order.len();
        order.dedup_by(|b, a| self.times[*a] >= self.times[*b]);
        let twice = before - order.len();
        for (n, what) in [
            (without, "rows without a time were left out"),
            (twice, "rows with the time of an earlier one were left out"),
        ] {
            if n > 0 {
                self.notes.push(format!("{n} {what}"));
            }
        }
        if !sorted {
            self.notes.push("the rows were sorted by time".to_owned());
        }
        self.as_it_is &= without + twice == 0 && sorted;
        if order.len() < 3 {
            return Err(format!(
                "{} rows have a time of their own: a recording needs at least three",
                order.len()
            ));
        }
        let take = |values: &[f64]| order.iter().map(|row| values[*row]).collect();
        self.times = take(&self.times);
        for column in &mut self.columns {
            column.values = take(&column.values);
        }
        Ok(())
    }

    /// A file that is written anew has names and nothing else in its headings.
    fn give_clean_headings(&mut self) {
        if !self.as_it_is {
            // A component of a field keeps its brackets, by which a study knows it.
            for column in self.columns.iter_mut().filter(|column| component_of(&column.heading).is_none()) {
                column.heading.clone_from(&column.name);
            }
        }
    }
}

/// The field of which a heading is a component, `wall` of `wall[3]`.
pub(super) fn component_of(heading: &str) -> Option<&str> {
    let (field, index) = heading.strip_suffix(']')?.split_once('[')?;
    index.parse::<usize>().ok().map(|_| field)
}

fn unit_of(sheet: &Sheet, at: usize) -> String {
    let (name, unit) = name_and_unit(&sheet.headers[at]);
    let below = label(&sheet.units[at]);
    let of_name = || time_unit(&name).filter(|_| name.len() > 2).unwrap_or_default().to_owned();
    [unit, below].into_iter().find(|unit| !unit.is_empty()).unwrap_or_else(of_name)
}

/// All columns of numbers but the times, with their places in the file.
fn columns(sheet: &Sheet, skipped: &[usize], notes: &mut Vec<String>) -> Vec<(usize, Column)> {
    let mut names = Names::default();
    // The file that is written has a column of that name.
    names.take("time");
    let mut columns = Vec::new();
    for at in (0..sheet.headers.len()).filter(|at| !skipped.contains(at)) {
        let cells = || sheet.rows.iter().map(|row| row[at].as_str());
        let values: Vec<f64> = cells().map(|cell| number(cell).unwrap_or(f64::NAN)).collect();
        let n_number = values.iter().filter(|value| value.is_finite()).count();
        let n_text = cells().filter(|cell| number(cell).is_none() && !is_missing(cell)).count();
        let heading = &sheet.headers[at];
        if numbers_rows(sheet, at) {
            notes.push(format!("column `{heading}` numbers the rows and was left out"));
            continue;
        }
        if n_number <= n_text {
            let what = if n_text == 0 { "no value" } else { "texts" };
            notes.push(format!("column `{heading}` holds {what} and was left out"));
            continue;
        }
        if n_text > 0 {
            notes.push(format!("{n_text} cells of column `{heading}` are no numbers and count as gaps"));
        }
        let (name, unit) = name_and_unit(heading);
        let unit =
            [unit, label(&sheet.units[at])].into_iter().find(|unit| !unit.is_empty()).unwrap_or_default();
        let name = names.take(if name.is_empty() { "column" } else { &name });
        columns.push((at, Column { heading: heading.clone(), name, unit, values }));
    }
    columns
}
