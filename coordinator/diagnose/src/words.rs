//! What is said of a diagnosis: the sentence of the verdict, and what it is conditional on.

use starlings_models::units::spaced;

use crate::result::{AlarmFound, ScenarioFound, Verdict};

/// The verdict as a sentence; `left` are the scenarios that are left, the likeliest first.
pub(crate) fn says(verdict: Verdict, alarm: &AlarmFound, left: &[&ScenarioFound], time_unit: &str) -> String {
    let seen = alarm.seen.as_ref().map_or_else(
        || "a fault, by the fit of its scenario alone".to_owned(),
        |seen| {
            format!(
                "a fault, seen in `{}` of `{}` at {} {time_unit}",
                seen.output,
                seen.record,
                plain(seen.until)
            )
        },
    );
    match (verdict, left) {
        (Verdict::Named, [only, ..]) => {
            format!("{seen}: `{}` with probability {}{}", only.name, chance(only.probability), severity(only))
        }
        (Verdict::Undecided, all) => {
            let each = all.iter().map(|s| format!("`{}` ({})", s.name, chance(s.probability)));
            format!("{seen}: one of {}", each.collect::<Vec<_>>().join(", "))
        }
        (Verdict::Unexplained, [nearest, ..]) => format!(
            "{seen}, which no scenario of the library explains: the nearest, `{}`, leaves {} times the noise",
            nearest.name,
            plain(nearest.misfit.unwrap_or(f64::NAN).sqrt())
        ),
        _ => format!(
            "no fault: the model without one explains the recording, at a rate of false alarms of {}",
            plain(alarm.rate)
        ),
    }
}

fn severity(of: &ScenarioFound) -> String {
    of.severity().map_or_else(String::new, |s| {
        let [lo, hi] = s.interval90.map(plain);
        let unit = spaced(&s.unit);
        format!(", {} {}{unit} (90 %: {lo} to {hi})", s.name, plain(s.estimate))
    })
}

/// What the numbers suppose.
pub(crate) fn conditional_on() -> String {
    "Probabilities are among the library alone and conditional on the model, on the stated noise, white and Gaussian, and on the priors; \
     intervals are those of the likeliest fit at the stated noise."
        .to_owned()
}

/// Four digits.
fn plain(value: f64) -> String {
    if !value.is_finite() || value.abs() < 1e-300 {
        return format!("{value}");
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    if (-3..=9).contains(&digits) {
        let scale = 10_f64.powi(digits);
        return format!("{}", (value * scale).round() / scale);
    }
    format!("{value:.3e}")
}

fn chance(p: f64) -> String {
    format!("{p:.3}")
}
