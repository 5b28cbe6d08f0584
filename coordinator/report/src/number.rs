//! Numbers as text: as many digits as the uncertainty warrants, and no more.
//!
//! Everything that is not finite becomes an en dash, so no page ever shows the text of an invalid number.

use starlings_models::units::spaced;

/// What stands where a number is not known.
pub(crate) const ABSENT: &str = "–";

/// `value` to the second significant digit of its standard deviation; four digits when that is not known.
pub(crate) fn with_sd(value: f64, sd: f64) -> String {
    if sd.is_finite() && sd > 0.0 {
        at_place(value, (sd.log10().floor() as i32) - 1)
    } else {
        significant(value, 4)
    }
}

/// `value` to `digits` significant digits.
pub(crate) fn significant(value: f64, digits: i32) -> String {
    if value.is_finite() && value.abs() > 0.0 {
        at_place(value, value.abs().log10().floor() as i32 - digits + 1)
    } else {
        at_place(value, 0)
    }
}

/// `value` to three significant digits, with its unit; of a plain number (`1`) that is none.
pub(crate) fn quantity(value: f64, unit: &str) -> String {
    format!("{}{}", significant(value, 3), spaced(unit))
}

/// `value` as a tick of an axis whose ticks are `step` apart.
pub(crate) fn tick(value: f64, step: f64) -> String {
    if value.abs() < 1e-9 * step && !(1e-4..1e5).contains(&step) {
        return "0".to_owned();
    }
    let step = if step.is_finite() && step > 0.0 { step } else { value.abs().max(1e-12) };
    at_place(value, (step.log10() + 1e-9).floor() as i32)
}

/// A duration in seconds, in the unit a reader would choose.
pub(crate) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return ABSENT.to_owned();
    }
    match seconds {
        s if s <= 0.0 => "0 s".to_owned(),
        s if s < 1e-3 => format!("{} µs", significant(1e6 * s, 3)),
        s if s < 1.0 => format!("{} ms", significant(1e3 * s, 3)),
        s if s < 120.0 => format!("{} s", significant(s, 3)),
        s if s < 7200.0 => format!("{} min", significant(s / 60.0, 3)),
        s => format!("{} h", significant(s / 3600.0, 3)),
    }
}

/// A moment as people write it: `20261124-130531`, as the store has it in UTC, `2026-11-24T13:05:31Z` and `2026-11-24 13:05:31 UTC`
/// become `24 November 2026, 13:05 UTC`; any other text stays.
pub(crate) fn date(text: &str) -> String {
    const MONTHS: [&str; 12] = [
        "January",
        "February",
        "March",
        "April",
        "May",
        "June",
        "July",
        "August",
        "September",
        "October",
        "November",
        "December",
    ];
    if let Some(spread) = from_digits(text) {
        return date(&spread);
    }
    let read = || {
        let (day, rest) = text.split_once(['T', ' '])?;
        let mut parts = day.split('-').map(str::parse::<usize>);
        let [year, month, day] = [parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?];
        let clock = rest.get(..5).filter(|clock| clock.as_bytes()[2] == b':')?;
        let zone = if rest.ends_with('Z') || rest.ends_with("UTC") { " UTC" } else { "" };
        Some(format!("{day} {} {year}, {clock}{zone}", MONTHS.get(month.checked_sub(1)?)?))
    };
    read().unwrap_or_else(|| text.to_owned())
}

/// A moment of the store's form with the separators that people are used to.
fn from_digits(text: &str) -> Option<String> {
    let (day, clock) = text.split_once('-')?;
    let digits = |part: &str, n: usize| part.len() == n && part.bytes().all(|b| b.is_ascii_digit());
    (digits(day, 8) && digits(clock, 6)).then(|| {
        format!(
            "{}-{}-{} {}:{}:{} UTC",
            &day[..4],
            &day[4..6],
            &day[6..],
            &clock[..2],
            &clock[2..4],
            &clock[4..]
        )
    })
}

/// A part of one, in percent.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent.is_finite() { format!("{percent:.0}\u{a0}%") } else { ABSENT.to_owned() }
}

/// `value` rounded to 10^`place`; in powers of ten when plain digits would be long.
fn at_place(value: f64, place: i32) -> String {
    if !value.is_finite() {
        return ABSENT.to_owned();
    }
    let exponent = if value.abs() > 0.0 { value.abs().log10().floor() as i32 } else { 0 };
    if exponent >= 5 && (place > 0 || exponent >= 7) || exponent < -4 {
        let decimals = (exponent - place).clamp(0, 12) as usize;
        // Rounding may carry into the exponent (9.99 to 10), and 10^exponent may underflow: the formatter knows both.
        let text = format!("{value:.decimals$e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}×10{}", minus(mantissa), superscript(exponent));
    }
    if place > 0 {
        let unit = 10f64.powi(place);
        return minus(&format!("{:.0}", (value / unit).round() * unit));
    }
    minus(&format!("{value:.decimals$}", decimals = (-place).clamp(0, 12) as usize))
}

/// The typographic minus sign; zero has no sign.
fn minus(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

fn superscript(exponent: &str) -> String {
    let digit = |c| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    };
    exponent.chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_has_the_digits_that_its_standard_deviation_warrants() {
        assert_eq!(with_sd(3.367_12, 0.0213), "3.367");
        assert_eq!(with_sd(100.351, 0.62), "100.35");
        assert_eq!(with_sd(123_456.0, 2300.0), "1.235×10⁵");
        assert_eq!(with_sd(-0.000_012_34, 0.000_000_56), "−1.234×10⁻⁵");
        assert_eq!(with_sd(1234.0, 250.0), "1230");
        assert_eq!(with_sd(2.0, 0.0), "2.000");
    }

    #[test]
    fn what_is_not_finite_is_a_dash_and_a_rounded_zero_has_no_sign() {
        assert_eq!(with_sd(f64::NAN, 1.0), ABSENT);
        assert_eq!(with_sd(f64::INFINITY, f64::NAN), ABSENT);
        assert_eq!(duration(f64::NAN), ABSENT);
        assert_eq!(with_sd(-0.001, 1.0), "0.0");
    }

    #[test]
    fn the_smallest_and_the_largest_numbers_are_written_as_they_are() {
        assert_eq!(significant(f64::from_bits(1), 2), "4.9×10⁻³²⁴");
        assert_eq!(significant(f64::MAX, 3), "1.80×10³⁰⁸");
        assert_eq!(significant(-9.999e-7, 2), "−1.0×10⁻⁶");
    }

    #[test]
    fn a_quantity_has_three_digits_and_its_unit_if_it_has_one() {
        assert_eq!(quantity(-0.012_345, "mmHg"), "−0.0123 mmHg");
        assert_eq!(quantity(2.0, ""), "2.00");
        assert_eq!(quantity(f64::NAN, "s"), "– s");
    }

    #[test]
    fn moments_are_written_as_people_write_them() {
        assert_eq!(date("2026-11-24T13:05:31Z"), "24 November 2026, 13:05 UTC");
        assert_eq!(date("20261124-130531"), "24 November 2026, 13:05 UTC");
        assert_eq!(date("2026-03-02 14:05:31 UTC"), "2 March 2026, 14:05 UTC");
        for odd in ["", "yesterday", "2026-13-02 14:05 UTC", "2026-00-02T14:05Z", "2026-01-02 ä"] {
            assert_eq!(date(odd), odd);
        }
    }

    #[test]
    fn durations_choose_their_unit() {
        assert_eq!(duration(0.000_020_4), "20.4 µs");
        assert_eq!(duration(0.0123), "12.3 ms");
        assert_eq!(duration(4.0), "4.00 s");
        assert_eq!(duration(7200.0), "2.00 h");
    }
}
