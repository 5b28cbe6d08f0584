//! A wide prior around an estimate: at least ten of its standard deviations, within what physics allows.
//!
//! The estimate comes from the same recordings that the new study will fit: a narrow prior would count them twice.

use starlings_estimators::Transform;
use starlings_models::units::rounded;
use toml_edit::{InlineTable, Value};

use crate::tell::result::Coefficient;

/// How many standard deviations of the estimate one of the prior spans at least.
const SDS: f64 = 10.0;
/// Factor of a logarithmic prior at least; beyond [`WIDEST`] an estimate says nothing.
const FACTOR: f64 = 5.0;
const WIDEST: f64 = 1e6;
/// Standard deviation of a logit prior at least, which is nearly uniform between the bounds, and at most.
const ODDS: [f64; 2] = [1.5, 5.0];
/// Share of the width between two bounds that an estimate at a bound is moved inside.
const INSIDE: f64 = 1e-6;

/// The prior of a parameter as the study writes it. `range` is what physics allows.
pub(super) fn prior(value: &Coefficient, [lo, hi]: [f64; 2]) -> InlineTable {
    let (estimate, sd) = (value.estimate, value.sd.abs());
    let mut table = InlineTable::new();
    if lo.is_finite() && hi.is_finite() && lo < hi {
        let edge = INSIDE * (hi - lo);
        let median = estimate.clamp(lo + edge, hi - edge);
        let transform = Transform::Logit { lo, hi };
        let slope = transform.derivative(transform.to_transformed(median));
        table.insert("transform", Value::from(format!("logit({lo:?}, {hi:?})")));
        table.insert("median", Value::from(median));
        table.insert("sd", Value::from(rounded_up(SDS * sd / slope).clamp(ODDS[0], ODDS[1])));
    } else if lo >= 0.0 && hi.is_infinite() && estimate > 0.0 {
        let factor = (SDS * sd / estimate).min(WIDEST.ln()).exp();
        table.insert("transform", Value::from("log"));
        table.insert("median", Value::from(estimate));
        table.insert("factor", Value::from(rounded_up(factor).clamp(FACTOR, WIDEST)));
    } else {
        let wide = (SDS * sd).max(estimate.abs());
        table.insert("transform", Value::from("linear"));
        table.insert("median", Value::from(estimate));
        table.insert("sd", Value::from(if wide > 0.0 { rounded_up(wide) } else { 1.0 }));
    }
    table
}

/// Two significant digits, never less than the value.
fn rounded_up(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return value;
    }
    let unit = 10_f64.powi(value.log10().floor() as i32 - 1);
    rounded((value / unit - 1e-9).ceil() * unit, 2)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn table(estimate: f64, sd: f64, range: [f64; 2]) -> InlineTable {
        let (name, unit) = ("q".to_owned(), String::new());
        prior(&Coefficient { name, unit, estimate, sd, interval95: [0.0; 2] }, range)
    }

    fn number(table: &InlineTable, key: &str) -> f64 {
        table.get(key).unwrap().as_float().unwrap()
    }

    #[test]
    fn a_positive_value_gets_a_logarithmic_prior_no_narrower_than_ten_sd() {
        let narrow = table(0.05, 0.001, [0.0, f64::INFINITY]);
        assert_eq!(narrow.get("transform").unwrap().as_str(), Some("log"));
        // Both numbers are written as they are.
        assert!((number(&narrow, "median") - 0.05).abs() < 1e-15);
        assert!((number(&narrow, "factor") - 5.0).abs() < 1e-15);
        let wide = table(0.05, 0.02, [0.0, f64::INFINITY]);
        let sd = number(&wide, "factor").ln();
        assert!((4.0..4.1).contains(&sd), "ten sd are 4 in the logarithm, found {sd}");
    }

    #[test]
    fn a_value_between_bounds_gets_a_logit_and_stays_inside() {
        let at_the_edge = table(1.0, 0.1, [0.0, 1.0]);
        assert_eq!(at_the_edge.get("transform").unwrap().as_str(), Some("logit(0.0, 1.0)"));
        assert!(number(&at_the_edge, "median") < 1.0);
        let inside = table(0.5, 0.05, [0.0, 1.0]);
        // The slope of the logit at its middle is a quarter: 10 · 0.05 / 0.25.
        assert!((number(&inside, "sd") - 2.0).abs() < 1e-12);
    }

    #[test]
    fn any_other_value_gets_a_linear_prior_that_reaches_ten_sd_and_zero() {
        let sure = table(-2.0, 0.01, [f64::NEG_INFINITY, f64::INFINITY]);
        assert!((number(&sure, "sd") - 2.0).abs() < 1e-12);
        let unsure = table(0.1, 0.313, [f64::NEG_INFINITY, 0.5]);
        // 3.13 in two digits, rounded up.
        assert!((number(&unsure, "sd") - 3.2).abs() < 1e-12);
        assert!((number(&table(0.0, 0.0, [-1.0, f64::INFINITY]), "sd") - 1.0).abs() < 1e-12);
    }
}
