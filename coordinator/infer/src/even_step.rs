//! The step of a recording's times.
//!
//! Next file to read: `blocks.rs`.

use starlings_estimators::inference::STEP_TOLERANCE;

/// The step of times that are in equal steps, or else the most usual one, with the digits that they support; `None` where no time is later
/// than the one before.
pub(crate) fn even_step(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let median = *steps.get(steps.len() / 2)?;
    let even = steps.iter().all(|step| (step - median).abs() <= STEP_TOLERANCE * median);
    let whole = even && steps.len() + 1 == times.len();
    if !whole {
        return Some(rounded(median, times, 1));
    }
    let n = steps.len();
    Some(rounded((times[n] - times[0]) / n as f64, times, n))
}

/// A step that is the difference of two of these times over so many steps, as the shortest number that their digits allow.
pub(crate) fn rounded(step: f64, times: &[f64], n_step: usize) -> f64 {
    let largest = times.iter().fold(0.0_f64, |most, time| most.max(time.abs()));
    // As a program writes it, 0.1 + 0.2 has seventeen digits: less than its rounding no time says.
    let unit =
        times.iter().map(|time| last_digit(*time)).fold(f64::INFINITY, f64::min).max(largest * f64::EPSILON);
    // Of numbers as far apart as that this one is the nearest.
    let off = 0.5 * unit / n_step as f64 + step * f64::EPSILON;
    let shorter = (0..17).filter_map(|digits| format!("{step:.digits$e}").parse::<f64>().ok());
    shorter.into_iter().find(|short| (short - step).abs() <= off).unwrap_or(step)
}

/// What one of the last digit of a number is worth, as it is written shortest.
fn last_digit(value: f64) -> f64 {
    let text = format!("{value}");
    let places = text.split_once('.').map_or(0, |(_, places)| places.len());
    10.0_f64.powf(-(places as f64))
}

/// What is said of a row that does not follow the one before it by one step, and what to do.
pub(crate) fn uneven(step: f64, before: f64, time: f64) -> (String, &'static str) {
    if time <= before {
        (
            format!("time {time} is not later than {before} in the row before"),
            "keep one row per time, in their order",
        )
    } else if time - before > 1.5 * step {
        (
            format!("time jumps from {before} to {time}, over more than one step of {step}"),
            "use gaps = \"break\" in [infer] to go on behind it without a step across",
        )
    } else {
        (
            format!(
                "the step from {before} to {time} is {} where the recording's is {step}",
                rounded(time - before, &[before, time], 1)
            ),
            "an inference needs equal steps: `resample = STEP` in [infer] interpolates to them",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::even_step;

    #[test]
    fn a_step_has_the_digits_of_the_times_and_not_those_of_their_differences() {
        let every = |step: f64, n: i32| -> Vec<f64> { (0..=n).map(|k| f64::from(k) * step).collect() };
        let decimal = |text: &[&str]| -> Vec<f64> { text.iter().filter_map(|t| t.parse().ok()).collect() };
        let cases: [(Vec<f64>, f64); 8] = [
            (every(0.02, 999), 0.02),
            (every(0.005, 300), 0.005),
            (every(1e-7, 999), 1e-7),
            (decimal(&["100.02", "100.04", "100.06"]), 0.02),
            // A row is missing: the most usual step.
            (decimal(&["0.1", "0.2", "0.3", "0.5", "0.6"]), 0.1),
            (decimal(&["0", "1.009", "2.018", "4.036"]), 1.009),
            // Thirds, written with three digits.
            (decimal(&["0", "0.333", "0.667", "1"]), 0.3333),
            (decimal(&["1000000", "1000001", "1000002"]), 1.0),
        ];
        for (times, step) in cases {
            let found = even_step(&times);
            assert!(found.is_some_and(|found| found.to_bits() == step.to_bits()), "{found:?} for {step}");
        }
        assert_eq!(even_step(&[1.0, 1.0]), None);
    }
}
