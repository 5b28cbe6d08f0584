//! Files of a study's folder.

use std::path::Path;

use crate::DraftError;

/// Writes a table as CSV.
pub(crate) fn write_table<R: AsRef<[String]>>(
    file: &Path,
    rows: impl IntoIterator<Item = R>,
) -> Result<(), DraftError> {
    let write = || -> Result<(), csv::Error> {
        let mut table = csv::Writer::from_path(file)?;
        for row in rows {
            table.write_record(row.as_ref())?;
        }
        Ok(table.flush()?)
    };
    write().map_err(|error| DraftError::Write { file: file.to_owned(), error: error.into() })
}

/// A text as TOML writes it.
pub(crate) fn quoted(text: &str) -> String {
    toml_edit::value(text).to_string().trim().to_owned()
}

/// Two significant digits: a standard deviation deserves no more.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// The size of a standard deviation for values: a part of their range, of their size where they are constant, 1 where they are zero.
pub(crate) fn part_of_range(values: &[f64], part: f64) -> f64 {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let size = low.abs().max(high.abs());
    let range = if high - low > 1e-6 * size { high - low } else { size };
    if range > 0.0 && range.is_finite() { rounded(part * range) } else { 1.0 }
}
