//! The warnings about noise that a study leaves to be found: one per output, whatever the number of its records.
//!
//! Next file to read: [`super::pooled_noise`].

use super::channel::with_unit;
use starlings_models::quoted_list;

/// Records that a warning names; of more it tells their number.
const NAMED: usize = 3;
const CURE: &str = "Give the sensor's standard deviation if it is known.";

/// A noise that was found from what a record holds of an output.
#[derive(Clone, Debug)]
pub(crate) struct FoundNoise {
    /// Output or field.
    pub(super) output: String,
    pub(super) record: String,
    /// Standard deviation in `unit`.
    pub(super) sd: f64,
    pub(super) unit: String,
    /// From what, beginning with "from".
    pub(super) how: String,
    /// Whether the samples are not evenly spaced, so that it may be too large.
    pub(super) is_uneven: bool,
}

/// One warning per output and unit, in the order in which they were first seen.
pub(crate) fn warnings(found: &[FoundNoise]) -> Vec<String> {
    let mut groups: Vec<Vec<&FoundNoise>> = Vec::new();
    for f in found {
        match groups.iter_mut().find(|group| (&group[0].output, &group[0].unit) == (&f.output, &f.unit)) {
            Some(group) => group.push(f),
            None => groups.push(vec![f]),
        }
    }
    groups.iter().map(|group| warning(group)).collect()
}

/// What was found of one output.
fn warning(found: &[&FoundNoise]) -> String {
    let of = |f: &FoundNoise| with_unit(f.sd, &f.unit);
    let (output, records) = (&found[0].output, in_records(found));
    if found.iter().all(|f| (of(f), &f.how) == (of(found[0]), &found[0].how)) {
        return format!(
            "the noise of `{output}` in {records} was not given: {} was found {}. {CURE}",
            of(found[0]),
            found[0].how
        );
    }
    let least = found.iter().map(|f| f.sd).fold(f64::INFINITY, f64::min);
    let most = found.iter().map(|f| f.sd).fold(0.0, f64::max);
    let uneven = if found.iter().any(|f| f.is_uneven) {
        " (some are not evenly spaced: it may be too large)"
    } else {
        ""
    };
    format!(
        "the noise of `{output}` in {records} was not given: {} to {} were found from the third differences of their \
         samples{uneven}. {CURE}",
        with_unit(least, &found[0].unit),
        with_unit(most, &found[0].unit)
    )
}

fn in_records(found: &[&FoundNoise]) -> String {
    let names: Vec<&str> = found.iter().map(|f| f.record.as_str()).collect();
    match names.len() {
        1 => format!("record {}", quoted_list(&names)),
        n if n <= NAMED => format!("records {}", quoted_list(&names)),
        n => format!("{n} records"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(output: &str, record: &str, sd: f64, how: &str) -> FoundNoise {
        let [output, record, unit, how] = [output, record, "K", how].map(str::to_owned);
        FoundNoise { output, record, sd, unit, how, is_uneven: false }
    }

    #[test]
    fn equal_noise_of_many_records_is_told_once_and_different_noise_by_its_range() {
        let pooled = "from the third differences of the 90 samples of 4 records, pooled";
        let mut all: Vec<FoundNoise> = ["a", "b", "c", "d"].map(|r| found("T", r, 0.02, pooled)).into();
        all.push(found("p", "a", 0.5, "from the third differences of its 80 samples"));
        let said = warnings(&all);
        assert_eq!(said.len(), 2);
        assert!(
            said[0].starts_with("the noise of `T` in 4 records was not given: 0.02 K was found from"),
            "{said:?}"
        );
        assert!(
            said[1].starts_with("the noise of `p` in record `a` was not given: 0.5 K was found from"),
            "{said:?}"
        );
        all[1].sd = 0.03;
        all[2].is_uneven = true;
        let said = warnings(&all);
        assert!(said[0].contains("in 4 records was not given: 0.02 K to 0.03 K were found"), "{said:?}");
        assert!(said[0].contains("some are not evenly spaced"), "{said:?}");
        all[3].unit = "mK".to_owned();
        assert_eq!(warnings(&all).len(), 3, "no range of two units");
    }
}
