//! Dates and clock times of a recording as seconds.
//!
//! Next file to read: [`super::recording`].

use jiff::civil::{Date, DateTime, Time};

/// Date, in the order of the file, of texts that are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Ymd,
    Dmy,
    Mdy,
}

/// A moment as a cell has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// Seconds of the date since 1970-01-01; `None` of a clock alone.
    date: Option<f64>,
    /// Seconds of the clock since midnight; `None` of a date alone.
    clock: Option<f64>,
    /// Seconds to be taken off for the time zone that is written.
    zone: f64,
}

/// Three numbers separated by one sign.
fn three(text: &str) -> Option<([i64; 3], char)> {
    let sign = text.chars().find(|c| !c.is_ascii_digit())?;
    if !['-', '/', '.'].contains(&sign) {
        return None;
    }
    let parts: Vec<&str> = text.split(sign).collect();
    let [a, b, c] = parts[..] else { return None };
    let number = |part: &str| (1..=4).contains(&part.len()).then(|| part.parse().ok()).flatten();
    // A version such as 1.2.3 is no date: a year has four digits.
    (a.len() == 4 || c.len() == 4).then_some(())?;
    Some(([number(a)?, number(b)?, number(c)?], sign))
}

/// The order of the dates of a column.
///
/// # Errors
/// When day and month cannot be told apart.
pub(super) fn order_of<'a>(cells: impl Iterator<Item = &'a str>) -> Result<Order, String> {
    let mut ambiguous = None;
    for cell in cells {
        let Some(([a, b, _], sign)) = three(date_part(cell)) else { continue };
        if a > 31 {
            return Ok(Order::Ymd);
        }
        if sign == '.' || a > 12 {
            return Ok(Order::Dmy);
        }
        if b > 12 {
            return Ok(Order::Mdy);
        }
        ambiguous = ambiguous.or(Some(cell));
    }
    match ambiguous {
        None => Ok(Order::Ymd),
        Some(cell) => Err(format!(
            "in `{cell}` day and month cannot be told apart: write dates as 2024-01-31, or seconds"
        )),
    }
}

fn date_part(cell: &str) -> &str {
    cell.trim().split(['T', ' ']).next().unwrap_or_default()
}

impl Moment {
    /// Whether a cell is a moment, in whichever order its date is.
    pub(super) fn is(cell: &str) -> bool {
        [Order::Ymd, Order::Dmy, Order::Mdy].into_iter().any(|order| Self::of(cell, order).is_some())
    }

    /// The moment of a cell.
    pub(super) fn of(cell: &str, order: Order) -> Option<Self> {
        let cell = cell.trim();
        let date = date_part(cell);
        if let Some(date) = seconds_of_date(date, order) {
            let rest = cell[date_part(cell).len()..].trim_start_matches(['T', ' ']);
            let (clock, zone) =
                if rest.is_empty() { (None, 0.0) } else { clock(rest).map(|(c, z)| (Some(c), z))? };
            return Some(Self { date: Some(date), clock, zone });
        }
        let (clock, zone) = clock(cell)?;
        Some(Self { date: None, clock: Some(clock), zone })
    }

    /// Whether it has a date without a clock, or a clock without a date.
    pub(super) fn is_half(self, wants_date: bool) -> bool {
        if wants_date { self.date.is_some() && self.clock.is_none() } else { self.date.is_none() }
    }

    /// One moment of a date and a clock in two columns.
    pub(super) fn join(self, clock: Self) -> Self {
        Self { clock: clock.clock, zone: clock.zone, ..self }
    }

    /// Seconds, since 1970 or since midnight.
    pub(super) fn seconds(self) -> f64 {
        self.date.unwrap_or(0.0) + self.clock.unwrap_or(0.0) - self.zone
    }

    /// Whether it is only a clock, which begins anew at midnight.
    pub(super) fn is_clock(self) -> bool {
        self.date.is_none()
    }
}

fn seconds_of_date(text: &str, order: Order) -> Option<f64> {
    let ([a, b, c], _) = three(text)?;
    let [year, month, day] = match order {
        Order::Ymd => [a, b, c],
        Order::Dmy => [c, b, a],
        Order::Mdy => [c, a, b],
    };
    let date = Date::new(year.try_into().ok()?, month.try_into().ok()?, day.try_into().ok()?).ok()?;
    let midnight = DateTime::from_parts(date, Time::midnight());
    Some(
        midnight.duration_since(DateTime::from_parts(Date::new(1970, 1, 1).ok()?, Time::midnight())).as_secs()
            as f64,
    )
}

/// Seconds since midnight, and those of the zone that is written behind.
fn clock(text: &str) -> Option<(f64, f64)> {
    let (text, afternoon) = match text.to_ascii_uppercase() {
        upper if upper.ends_with("PM") => (text[..text.len() - 2].trim_end(), Some(true)),
        upper if upper.ends_with("AM") => (text[..text.len() - 2].trim_end(), Some(false)),
        _ => (text, None),
    };
    let bare = text.strip_suffix('Z').unwrap_or(text);
    let (bare, zone) = match bare.rfind(['+', '-']) {
        Some(at) => (&bare[..at], zone(&bare[at..])?),
        None => (bare, 0.0),
    };
    let parts: Vec<&str> = bare.trim().split(':').collect();
    if !(2..=3).contains(&parts.len()) {
        return None;
    }
    let whole = |part: &str| (1..=2).contains(&part.len()).then(|| part.parse::<u32>().ok()).flatten();
    let (hour, minute) = (whole(parts[0])?, whole(parts[1])?);
    let second = parts.get(2).map_or(Some(0.0), |part| {
        part.starts_with(|c: char| c.is_ascii_digit())
            .then(|| part.replace(',', ".").parse::<f64>().ok())
            .flatten()
    })?;
    let hour = match afternoon {
        Some(afternoon) => hour % 12 + 12 * u32::from(afternoon),
        None => hour,
    };
    let fits = hour < 25 && minute < 60 && (0.0..61.0).contains(&second);
    fits.then_some((f64::from(3600 * hour + 60 * minute) + second, zone))
}

/// `+02:00` or `+0200` in seconds.
fn zone(text: &str) -> Option<f64> {
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let digits: String = text[1..].chars().filter(|c| *c != ':').collect();
    let number: u32 = (digits.len() == 4 || digits.len() == 2).then(|| digits.parse().ok()).flatten()?;
    let (hours, minutes) = if digits.len() == 2 { (number, 0) } else { (number / 100, number % 100) };
    Some(sign * f64::from(3600 * hours + 60 * minutes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(cell: &str, order: Order) -> Option<f64> {
        Moment::of(cell, order).map(Moment::seconds)
    }

    #[test]
    fn moments_of_many_forms_are_the_same_seconds() {
        let wanted = Some(1_704_457_830.5);
        for (cell, order) in [
            ("2024-01-05 12:30:30.5", Order::Ymd),
            ("2024-01-05T12:30:30.5Z", Order::Ymd),
            ("2024-01-05T14:30:30,5+02:00", Order::Ymd),
            ("05.01.2024 12:30:30,5", Order::Dmy),
            ("1/5/2024 12:30:30.5 PM", Order::Mdy),
        ] {
            assert_eq!(seconds(cell, order), wanted, "{cell}");
        }
        assert_eq!(seconds("00:01:30", Order::Ymd), Some(90.0));
    }

    #[test]
    fn numbers_versions_and_impossible_dates_are_no_moments() {
        for cell in ["12", "1.2.3", "2024-13-05", "2024-02-30", "12:70", "a:b", "", "1-2", "12:3:4:5"] {
            assert!(Moment::of(cell, Order::Ymd).is_none(), "{cell}");
        }
    }

    #[test]
    fn the_order_of_a_date_is_found_where_one_of_them_tells_it() {
        let of = |cells: &[&str]| order_of(cells.iter().copied());
        assert_eq!(of(&["1/5/2024", "1/13/2024"]), Ok(Order::Mdy));
        assert_eq!(of(&["1/5/2024", "13/5/2024"]), Ok(Order::Dmy));
        assert_eq!(of(&["05.01.2024"]), Ok(Order::Dmy));
        assert_eq!(of(&["2024/01/05"]), Ok(Order::Ymd));
        assert!(of(&["1/5/2024", "2/5/2024"]).is_err());
    }
}
