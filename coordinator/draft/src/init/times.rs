//! The times of a table: the column that holds them, and dates and clocks as seconds.
//!
//! Next file to read: [`super::recording`].

use super::cells::number;
use super::header::{is_time, name_and_unit};
use super::moment::{Moment, order_of};
use super::row_numbers::numbers_rows;
use super::sheet::Sheet;
use super::{Ask, Question};

/// How a person says where the times are.
#[derive(Clone, Debug, Default)]
pub(super) struct TimeWish<'a> {
    pub(super) column: Option<&'a str>,
    pub(super) step: Option<f64>,
}

/// Times of a file.
pub(super) struct Times {
    pub(super) values: Vec<f64>,
    /// Column of clock times that belong to the dates.
    pub(super) clock: Option<usize>,
    pub(super) of_dates: bool,
}

impl Times {
    /// Rows that are equal steps apart, from zero.
    pub(super) fn counted(n: usize, step: f64) -> Self {
        Self { values: (0..n).map(|row| row as f64 * step).collect(), clock: None, of_dates: false }
    }
}

/// The column of the times: as it was asked for, by its name, or the first that increases.
pub(super) fn time_column(sheet: &Sheet, wish: Option<&str>, ask: Ask<'_>) -> Result<usize, String> {
    let names: Vec<String> = sheet.headers.iter().map(|heading| name_and_unit(heading).0).collect();
    let find =
        |wanted: &str| (0..names.len()).find(|at| sheet.headers[*at] == wanted || names[*at] == wanted);
    if let Some(wanted) = wish {
        return find(wanted)
            .ok_or_else(|| format!("there is no column `{wanted}` (columns: {})", sheet.headers.join(", ")));
    }
    if let Some(at) = names.iter().position(|name| is_time(name)) {
        return Ok(at);
    }
    let is_date = |at: &usize| sheet.rows.iter().take(5).all(|row| Moment::is(&row[*at]));
    let increases = |at: &usize| {
        let mut cells = sheet.rows.iter().map(|row| number(&row[*at]));
        let mut last = f64::NEG_INFINITY;
        sheet.rows.len() > 2
            && cells.all(|cell| {
                let later = cell.is_some_and(|value| value > last);
                last = cell.unwrap_or(last);
                later
            })
    };
    let columns = 0..names.len();
    let first = columns.clone().find(|at| !numbers_rows(sheet, *at)).filter(increases);
    let rows = || columns.clone().find(|at| numbers_rows(sheet, *at));
    let found = columns.clone().find(is_date).or(first).or_else(rows);
    if let Some(at) = found {
        return Ok(at);
    }
    let question = Question {
        text: "Which column is the time?".to_owned(),
        choices: names.clone(),
        default: None,
        option: "--time COLUMN, or --step STEP where rows are equal steps apart".to_owned(),
    };
    let answer = ask(&question)
        .ok_or_else(|| question.unanswered("no column is called time, and the first does not increase"))?;
    find(&answer).ok_or_else(|| format!("there is no column `{answer}`"))
}

/// The times of a column, and of the clock beside it where it holds dates alone.
pub(super) fn times(sheet: &mut Sheet, column: usize) -> Result<Times, String> {
    let n_number = sheet.rows.iter().filter(|row| number(&row[column]).is_some()).count();
    if 2 * n_number >= sheet.rows.len() {
        let values = sheet.rows.iter().map(|row| number(&row[column]).unwrap_or(f64::NAN)).collect();
        return Ok(Times { values, clock: None, of_dates: false });
    }
    let heading = sheet.headers[column].clone();
    let order = order_of(sheet.rows.iter().map(|row| row[column].as_str()))?;
    let moments = |at: usize| -> Vec<Option<Moment>> {
        sheet.rows.iter().map(|row| Moment::of(&row[at], order)).collect()
    };
    let found = moments(column);
    if 2 * found.iter().flatten().count() < found.len() {
        return Err(format!(
            "column `{heading}` holds neither numbers nor dates: name the time by --time COLUMN"
        ));
    }
    let half = |moments: &[Option<Moment>], date: bool| moments.iter().flatten().all(|m| m.is_half(date));
    let clock = half(&found, true)
        .then(|| {
            (0..sheet.headers.len()).find(|at| {
                let other = moments(*at);
                *at != column
                    && other.iter().flatten().count() == found.iter().flatten().count()
                    && half(&other, false)
            })
        })
        .flatten();
    let clocks = clock.map(moments);
    let joined = found.iter().enumerate().map(|(row, date)| {
        let clock = clocks.as_ref().map(|clocks| clocks[row]);
        match clock {
            Some(clock) => Some((*date)?.join(clock?)),
            None => *date,
        }
    });
    let joined: Vec<Option<Moment>> = joined.collect();
    sheet.notes.push(match clock {
        Some(clock) => format!(
            "times are seconds after the first row, of the dates in `{heading}` and the clock in `{}`",
            sheet.headers[clock]
        ),
        None => format!("times are seconds after the first row, of the dates in `{heading}`"),
    });
    Ok(Times { values: from_first(&joined), clock, of_dates: true })
}

/// Seconds after the first moment; a clock without a date goes on after midnight.
fn from_first(moments: &[Option<Moment>]) -> Vec<f64> {
    let first = moments.iter().flatten().next().map_or(0.0, |moment| moment.seconds());
    let (mut days, mut last) = (0.0, f64::NEG_INFINITY);
    let seconds = |moment: &Option<Moment>| {
        let Some(moment) = moment else { return f64::NAN };
        let at = moment.seconds();
        // An hour back is a slip or another time; half a day is midnight.
        if moment.is_clock() && at + days < last - 43_200.0 {
            days += 86_400.0;
        }
        last = at + days;
        last - first
    };
    moments.iter().map(seconds).collect()
}
