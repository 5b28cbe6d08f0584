//! The noise of short records, found from all records of one output: one short record tells it badly.
//!
//! Next file to read: [`super::noise`].

use starlings_estimators::{n_third_difference, noise_from_third_differences};

use super::found_noise::FoundNoise;
use crate::checked::{Channel, Record};
use crate::field::field_of;

/// Third differences from which a record tells its noise alone: their median scatters by a fifth then, and by more with fewer.
const ENOUGH: usize = 50;
/// How a noise begins that was found from the samples of one channel of one record.
pub(super) const FOUND: &str = "from the third differences of its ";

/// Gives the channels of short records, where the study leaves their noise to be found, the noise that all records of that output tell
/// together; what is told of it follows. A record that is held out tells nothing of another one's noise.
pub(crate) fn pool_short_records(records: &mut [Record], found: &mut [FoundNoise]) {
    let is_found = |channel: &Channel| channel.noise_how.starts_with(FOUND);
    let mut pooled: Vec<(usize, usize, f64, String, usize)> = Vec::new();
    for (r, record) in records.iter().enumerate() {
        for (c, channel) in record.channels.iter().enumerate().filter(|(_, channel)| is_found(channel)) {
            let own = used(record, channel);
            let same = |other: &&Channel| {
                is_found(other) && other.output == channel.output && other.unit == channel.unit
            };
            let others: Vec<Vec<f64>> = (records.iter().enumerate())
                .filter(|(other, of)| *other != r && of.train.is_some())
                .flat_map(|(_, of)| of.channels.iter().filter(same).map(|channel| used(of, channel)))
                .collect();
            if own.len() >= ENOUGH + 3 || others.is_empty() {
                continue;
            }
            let n = own.len() + others.iter().map(Vec::len).sum::<usize>();
            let how = format!(
                "from the third differences of the {n} samples of {} records, pooled",
                others.len() + 1
            );
            // No difference reaches over the missing value between two records.
            let series = others.into_iter().fold(own, |all, other| [all, vec![f64::NAN], other].concat());
            let sd = noise_from_third_differences(&series);
            if sd > 0.0 && sd.is_finite() {
                pooled.push((r, c, sd, how, n_third_difference(&series)));
            }
        }
    }
    for (r, c, sd, how, n_difference) in pooled {
        let Record { name, channels, .. } = &mut records[r];
        let channel = &mut channels[c];
        let told =
            |f: &&mut FoundNoise| f.record == *name && field_of(&f.output) == field_of(&channel.output);
        for told in found.iter_mut().filter(told) {
            (told.sd, told.how) = (sd, how.clone());
        }
        (channel.noise, channel.noise_how, channel.noise_found_from) = (sd, how, Some(n_difference));
    }
}

/// The values of a channel that count: those of the training span, or all of a record that is held out.
fn used(record: &Record, channel: &Channel) -> Vec<f64> {
    let counts = |time: f64| record.train.is_none_or(|[from, to]| from <= time && time <= to);
    let rows = channel.values.iter().zip(&record.times);
    rows.filter(|(_, time)| counts(**time)).map(|(value, _)| *value).collect()
}
