//! Values that stand apart from all around them, which no course of a system explains: they count as missing, and are told. The first and the
//! last value are told alone: there a change of the signal looks the same.
//!
//! Next file to read: `outliers.rs` of the estimators, for what is one.

use starlings_estimators::{Outlier, are_too_many, ends_apart, outliers};
use starlings_models::quoted_list;
use starlings_models::units::rounded;

use super::part::Part;
use super::reader::ChannelReader;
use crate::file::{ChannelSection, Outliers};

/// Lines that a warning names; of more it tells their number.
const NAMED: usize = 3;

impl ChannelReader<'_> {
    /// Takes outliers out of the values of a channel, or of the components of one that is a field, and says so.
    pub(super) fn leave_out(
        &self,
        section: &ChannelSection,
        measured: &mut [(Vec<f64>, Part)],
    ) -> Option<String> {
        if section.outliers.as_ref().is_some_and(|said| *said.get_ref() == Outliers::Keep) {
            return None;
        }
        let noise = *section.noise.get_ref();
        let (mut left_out, mut too_many, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for (values, part) in measured {
            let [first, last] = ends_apart(&self.table.times, values, noise);
            let of_part = [("first", first), ("last", last)];
            ends.extend(
                of_part.into_iter().filter_map(|(which, end)| Some((which, end?, part.column.clone()))),
            );
            let found = outliers(&self.table.times, values, noise);
            if are_too_many(&found, values) {
                too_many.push((found.len(), values.len(), part.column.clone()));
                continue;
            }
            for outlier in found {
                values[outlier.at] = f64::NAN;
                left_out.push((outlier, part.column.clone()));
            }
        }
        let said = [self.said_left_out(&left_out), self.said_kept(&too_many), self.said_ends(&ends)];
        let said: Vec<String> = said.into_iter().flatten().collect();
        (!said.is_empty()).then(|| said.join("; "))
    }

    fn said_left_out(&self, left_out: &[(Outlier, String)]) -> Option<String> {
        let (first, _) = left_out.first()?;
        let mut columns: Vec<&str> = left_out.iter().map(|(_, column)| column.as_str()).collect();
        columns.dedup();
        let lines =
            left_out.iter().take(NAMED).map(|(outlier, _)| self.table.csv.line(outlier.at).to_string());
        let lines = lines.collect::<Vec<_>>().join(", ");
        let more = left_out.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let least = left_out.iter().map(|(outlier, _)| outlier.times).fold(first.times, f64::min);
        let (of, are, line, they) = match left_out.len() {
            1 => ("a value".to_owned(), "is", "line", "it is"),
            n => (format!("{n} values"), "are", "lines", "each is"),
        };
        Some(format!(
            "{of} in {} of record `{}` {are} left out ({line} {lines}{more} of `{}`): {they} at least {} times as far from the line through its \
             neighbours as values of the column usually are, while the neighbours agree, which is a fault of the sensor and no course of a system; `outliers = \"keep\"` in \
             the channel keeps {}",
            columns_in_words(&columns),
            self.name(),
            self.section.file.get_ref(),
            rounded(least, 2),
            if left_out.len() == 1 { "it" } else { "them" },
        ))
    }

    fn said_kept(&self, too_many: &[(usize, usize, String)]) -> Option<String> {
        let (found, n, column) = too_many.first()?;
        Some(format!(
            "{found} of {n} values in column `{column}` of record `{}` stand apart from their neighbours, too many to be left out as faults of \
             single values: the signal has pulses, or its noise heavy tails; empty the cells of those that are faults",
            self.name()
        ))
    }

    fn said_ends(&self, ends: &[(&str, Outlier, String)]) -> Option<String> {
        let (which, end, column) = ends.first()?;
        let more = match ends.len() {
            1 => "",
            2 => ", and so does one more at an end of a column",
            _ => ", and so do others at ends of columns",
        };
        Some(format!(
            "the {which} value in column `{column}` of record `{}` (line {} of `{}`) stands apart from the course of those beside it, by {} times \
             the distance that is usual there{more}: a fault of the sensor, which the fit takes for the system's, or a change within one sample; empty \
             the cell of a fault, and `outliers = \"keep\"` in the channel says that it is none",
            self.name(),
            self.table.csv.line(end.at),
            self.section.file.get_ref(),
            rounded(end.times, 2),
        ))
    }
}

fn columns_in_words(columns: &[&str]) -> String {
    match columns {
        [one] => format!("column `{one}`"),
        some if some.len() <= NAMED => format!("columns {}", quoted_list(some)),
        many => format!("{} columns", many.len()),
    }
}
