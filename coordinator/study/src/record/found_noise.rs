//! The warnings about noise that a study leaves to be found: one per output, whatever the number of its records.
//!
//! Next file to read: [`super::pooled_noise`].

use super::channel::with_unit;
use crate::problem::quoted_list;

/// Records that a warning names; of more it tells their number.
const NAMED: usize = 3;
const CURE: &str = "Give the sensor's standard deviation if it is known.";
const UNEVEN: &str = "not evenly spaced";

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
}

/// One warning per output, in the order in which outputs were first seen.
pub(crate) fn warnings(found: &[FoundNoise]) -> Vec<String> {
    let is_first = |i: &usize| found[..*i].iter().all(|f| f.output != found[*i].output);
    let firsts = (0..found.len()).filter(is_first);
    firsts
        .map(|i| warning(&found.iter().filter(|f| f.output == found[i].output).collect::<Vec<_>>()))
        .collect()
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
    let (least, most) = found.iter().fold((found[0], found[0]), |(least, most), f| {
        (if f.sd < least.sd { f } else { least }, if f.sd > most.sd { f } else { most })
    });
    let uneven = if found.iter().any(|f| f.how.contains(UNEVEN)) {
        format!(" (some are {UNEVEN}: it may be too large)")
    } else {
        String::new()
    };
    format!(
        "the noise of `{output}` in {records} was not given: {} to {} were found from the third differences of their \
         samples{uneven}. {CURE}",
        of(least),
        of(most)
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
        FoundNoise { output, record, sd, unit, how }
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
        all[2].how =
            "from the third differences of its 60 samples (which are not evenly spaced: it may be too large)"
                .to_owned();
        let said = warnings(&all);
        assert!(said[0].contains("in 4 records was not given: 0.02 K to 0.03 K were found"), "{said:?}");
        assert!(said[0].contains("some are not evenly spaced"), "{said:?}");
    }
}
