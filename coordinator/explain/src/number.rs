//! Numbers as they are printed: thresholds on a round grid, figures of three digits, sizes in units of the noise.
//!
//! Next file to read: [`crate::locate`].

/// The nearest multiple of 1, 2 or 5 times a power of ten that is at most 2 % of `range`: a threshold moves by 1 % at most.
pub(crate) fn readable(value: f64, range: f64) -> f64 {
    let step = step(range);
    if step > 0.0 && value.is_finite() { (value / step).round() * step } else { value }
}

/// The largest of 1, 2 and 5 times a power of ten up to 2 % of `range`.
fn step(range: f64) -> f64 {
    let most = 0.02 * range;
    if !(most > 0.0 && most.is_finite()) {
        return 0.0;
    }
    let ten = 10f64.powi(most.log10().floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|m| m * ten).find(|s| *s <= most * (1.0 + 1e-9)).unwrap_or(ten)
}

/// A threshold with the digits of its grid.
pub(crate) fn threshold(value: f64, range: f64) -> String {
    let step = step(range);
    if step > 0.0 && value.abs() < 1e6 && step > 1e-7 {
        let digits = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
        trimmed(&format!("{value:.digits$}"))
    } else {
        three(value)
    }
}

/// Three significant digits, fewer where the last are zero.
pub(crate) fn three(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size > 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = if size > 0.0 { (2.0 - size.log10().floor()).max(0.0) as usize } else { 0 };
    trimmed(&format!("{value:.digits$}"))
}

fn trimmed(text: &str) -> String {
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

/// A share in per cent.
pub(crate) fn percent(share: f64) -> String {
    if share < 0.01 { format!("{:.1} %", 100.0 * share) } else { format!("{:.0} %", 100.0 * share) }
}

/// A size in units of the noise, in words: `2.50 times`.
pub(crate) fn times(ratio: f64) -> String {
    format!("{} times", factor(ratio))
}

/// A size in units of the noise.
pub(crate) fn factor(ratio: f64) -> String {
    if (0.01..1000.0).contains(&ratio) { format!("{ratio:.2}") } else { three(ratio) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_round_and_move_by_a_hundredth_of_the_range_at_most() {
        assert_eq!(threshold(readable(51.3, 400.0), 400.0), "50");
        assert_eq!(threshold(readable(-0.0231, 1.0), 1.0), "−0.02");
        assert_eq!(threshold(readable(1003.14, 4.0), 4.0), "1003.15");
        for k in 1..200 {
            let (value, range) = (0.137 * f64::from(k), 0.9 * f64::from(k) + 3.0);
            // Rounding to the nearest multiple of at most 2 % moves by half of it.
            assert!((readable(value, range) - value).abs() <= 0.0101 * range);
        }
    }

    #[test]
    fn figures_have_three_digits() {
        assert_eq!(three(14.712), "14.7");
        assert_eq!(three(2.0), "2");
        assert_eq!(three(-0.012_34), "−0.0123");
        assert_eq!(three(18_340.0), "18340");
        assert_eq!(three(0.000_012_3), "1.23e-5");
        assert_eq!(three(f64::NAN), "–");
    }
}
