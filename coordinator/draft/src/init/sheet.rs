//! A file of rows and columns as a spreadsheet or a logger writes it: cut into texts, with the names of the columns.
//!
//! The study reads one form of CSV; here anything is taken whose meaning is plain. What was not plain is noted. Next file to read:
//! [`super::cells`] for numbers, then [`super::recording`].

use super::cells::{is_missing, is_number, is_value};
use super::separator::separator_of;

/// Rows that are looked at to find out how a file is written.
const LOOKED_AT: usize = 400;

/// The texts of a file.
#[derive(Debug)]
pub(super) struct Sheet {
    /// Names of the columns as the file has them; made up where it has none.
    pub(super) headers: Vec<String>,
    /// What stands below the names where a row of units does; else empty texts.
    pub(super) units: Vec<String>,
    /// The cells, every row as long as `headers`.
    pub(super) rows: Vec<Vec<String>>,
    /// What was not plain, one sentence each.
    pub(super) notes: Vec<String>,
    /// Whether the study's own reader would find the same in the file.
    pub(super) plain: bool,
}

/// Cuts the bytes of a file into texts.
///
/// # Errors
/// One sentence with a remedy, when they are no table.
pub(super) fn sheet(bytes: &[u8]) -> Result<Sheet, String> {
    let mut notes = Vec::new();
    let text = decoded(bytes, &mut notes)?;
    let lines: Vec<&str> = text.lines().map(unmarked).filter(|line| !line.trim().is_empty()).collect();
    if lines.is_empty() {
        return Err("the file is empty: expected a row per time".to_owned());
    }
    let separator = separator_of(&lines[..lines.len().min(LOOKED_AT)]);
    let mut plain = notes.is_empty() && separator.is_comma() && !text.lines().any(|l| unmarked(l) != l);
    if !separator.is_comma() {
        notes.push(format!("columns were separated by {}", separator.says()));
    }
    let mut rows = separator.cut(&lines)?;
    let width = usual_width(&rows);
    let first = first_of_data(&rows, width);
    let Some(data) = rows.get(first..).filter(|data| !data.is_empty()) else {
        return Err("there is no row with numbers".to_owned());
    };
    let decimal_commas = !separator.is_comma() && data.iter().flatten().any(|cell| has_decimal_comma(cell));
    if decimal_commas {
        notes.push("numbers had decimal commas".to_owned());
    }
    let (headers, units, titles) = heading(&rows[..first], width);
    plain &= headers.is_some() && units.is_none() && titles == 0;
    if titles > 0 {
        notes.push(format!("{titles} lines above the names of the columns were passed over"));
    }
    if headers.is_none() {
        notes.push("the file has no names of columns: they are called c1, c2, …".to_owned());
    }
    if units.is_some() {
        notes.push("the line below the names was taken for units".to_owned());
    }
    let headers = headers.unwrap_or_else(|| (1..=width).map(|at| format!("c{at}")).collect());
    let units = units.unwrap_or_else(|| vec![String::new(); width]);
    let mut rows = rows.split_off(first);
    plain &= squared(&mut rows, width, &mut notes);
    let mut sheet = Sheet { headers, units, rows, notes, plain };
    sheet.drop_empty_columns();
    Ok(sheet)
}

impl Sheet {
    /// Whether the study's own reader finds the same in these columns.
    pub(super) fn is_as_a_study_reads(&self, used: &[usize]) -> bool {
        let plain = |cell: &str| {
            cell.is_empty() || cell.eq_ignore_ascii_case("nan") || cell.parse().is_ok_and(f64::is_finite)
        };
        let once = |at: &usize| self.headers.iter().filter(|other| **other == self.headers[*at]).count() == 1;
        self.plain && used.iter().all(|at| once(at) && self.rows.iter().all(|row| plain(&row[*at])))
    }

    /// A separator at the end of every line makes a column of nothing.
    fn drop_empty_columns(&mut self) {
        let is_empty = |at: usize| {
            self.headers[at].is_empty()
                && self.units[at].is_empty()
                && self.rows.iter().all(|row| row[at].is_empty())
        };
        let empty: Vec<bool> = (0..self.headers.len()).map(is_empty).collect();
        if !empty.contains(&true) {
            return;
        }
        self.plain = false;
        let keep = |list: &mut Vec<String>| {
            let mut at = 0..;
            list.retain(|_| !at.next().is_some_and(|at: usize| empty[at]));
        };
        keep(&mut self.headers);
        keep(&mut self.units);
        self.rows.iter_mut().for_each(keep);
    }
}

/// Text of the bytes, in whichever coding.
fn decoded(bytes: &[u8], notes: &mut Vec<String>) -> Result<String, String> {
    const PYTHON: &str = "read it in Python, `starlings.read`, or export it as CSV";
    let foreign = match bytes {
        [b'P', b'K', 3, 4, ..] => Some("a workbook or an archive: export the sheet as CSV".to_owned()),
        [0xD0, 0xCF, 0x11, 0xE0, ..] => Some("a workbook of an old kind: export the sheet as CSV".to_owned()),
        [b'P', b'A', b'R', b'1', ..] => Some(format!("a Parquet file: {PYTHON}")),
        [0x89, b'H', b'D', b'F', ..] => Some(format!("an HDF5 file (NetCDF 4, MATLAB 7.3): {PYTHON}")),
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => Some(format!("a NetCDF file: {PYTHON}")),
        _ if bytes.starts_with(b"MATLAB 5.0") => Some(format!("a MATLAB file: {PYTHON}")),
        _ => None,
    };
    if let Some(what) = foreign {
        return Err(format!("this is {what}"));
    }
    let words = |pair: fn([u8; 2]) -> u16| -> Vec<u16> {
        bytes[2..].chunks_exact(2).map(|two| pair([two[0], two[1]])).collect()
    };
    let utf16 = match bytes {
        [0xFF, 0xFE, ..] => Some(words(u16::from_le_bytes)),
        [0xFE, 0xFF, ..] => Some(words(u16::from_be_bytes)),
        _ => None,
    };
    if let Some(words) = utf16 {
        notes.push("the text was in UTF-16".to_owned());
        return String::from_utf16(&words).map_err(|_| "it begins as text in UTF-16 and is none".to_owned());
    }
    if bytes.contains(&0) {
        return Err("this is no text: export the table as CSV".to_owned());
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned());
    }
    notes.push("the text was not in UTF-8 and was read as Latin-1".to_owned());
    Ok(bytes.iter().map(|byte| char::from(*byte)).collect())
}

/// A line without the mark by which some programs begin their headings.
fn unmarked(line: &str) -> &str {
    line.trim_start().strip_prefix(['#', '%']).map_or(line, |rest| rest.trim_start_matches(['#', '%', ' ']))
}

/// The number of cells that most rows have.
fn usual_width(rows: &[Vec<String>]) -> usize {
    let widths = || rows.iter().take(LOOKED_AT).map(Vec::len);
    widths().max_by_key(|wanted| (widths().filter(|width| width == wanted).count(), *wanted)).unwrap_or(0)
}

/// The first row that is no heading: its texts stand in columns that go on as texts.
fn first_of_data(rows: &[Vec<String>], width: usize) -> usize {
    let is_data = |at: usize| {
        let row = &rows[at];
        let n_value = row.iter().filter(|cell| is_value(cell)).count();
        let named = |column: usize| {
            let is_text = !is_value(&row[column]) && !is_missing(&row[column]);
            let below = rows[at + 1..].iter().take(5).filter_map(|row| row.get(column));
            let next = below.filter(|cell| !is_missing(cell)).collect::<Vec<_>>();
            is_text && next.iter().any(|cell| is_value(cell))
        };
        row.len() == width && n_value > 0 && (at > 0 && 2 * n_value >= width || !(0..width).any(named))
    };
    (0..rows.len()).find(|at| is_data(*at)).unwrap_or(rows.len())
}

/// Names, units and the number of further lines above the data.
type Heading = (Option<Vec<String>>, Option<Vec<String>>, usize);

fn heading(above: &[Vec<String>], width: usize) -> Heading {
    let fits = |row: &&Vec<String>| {
        row.len() <= width && row.len() + 1 >= width && !row.iter().all(String::is_empty)
    };
    let padded = |row: &Vec<String>| {
        let mut row = row.clone();
        row.resize(width, String::new());
        row
    };
    let Some(last) = above.iter().rposition(|row| fits(&row)) else { return (None, None, above.len()) };
    let before = last.checked_sub(1).and_then(|at| above.get(at)).filter(fits);
    match before {
        Some(names)
            if above[last].iter().all(|cell| is_unit(cell)) && !names.iter().all(|cell| is_unit(cell)) =>
        {
            (Some(padded(names)), Some(padded(&above[last])), above.len() - 2)
        }
        _ => (Some(padded(&above[last])), None, above.len() - 1),
    }
}

/// Whether a cell below a name may be a unit.
fn is_unit(cell: &str) -> bool {
    let bare = cell.trim_matches(['(', ')', '[', ']', ' ']);
    bare.is_empty() || bare == "-" || bare == "1" || starlings_models::units::Unit::parse(bare).is_some()
}

/// Makes all rows of one length; whether they were.
fn squared(rows: &mut [Vec<String>], width: usize, notes: &mut Vec<String>) -> bool {
    let other = rows.iter().filter(|row| row.len() != width).count();
    for row in rows.iter_mut() {
        row.resize(width, String::new());
    }
    if other > 0 {
        notes.push(format!(
            "{other} rows have another number of cells than the others: what is missing counts as a gap"
        ));
    }
    other == 0
}

fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && is_number(cell)
}
