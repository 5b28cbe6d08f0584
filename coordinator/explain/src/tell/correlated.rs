//! The correlated noise of the recordings, in figures and in words.
//!
//! Next file to read: [`super::words`].

use starlings_models::units::spaced;
use starlings_study::Study;

use super::result::CorrelatedChannel;
use crate::judge::noise_model::{LargerNoise, larger as larger_noise};
use crate::number::{percent, three};
use crate::rows::{Rows, unit};

/// The outputs whose noise counts as correlated.
pub(crate) fn correlated_noise(study: &Study, rows: &Rows) -> Vec<CorrelatedChannel> {
    let of = |(output, name): (usize, &String)| {
        let noise = rows.noise.get(output)?.as_ref()?;
        let (channel, unit) = (name.clone(), study.time_unit.clone());
        Some(CorrelatedChannel { channel, share: noise.correlated, length: noise.length, unit })
    };
    study.setup.outputs.iter().enumerate().filter_map(of).collect()
}

impl CorrelatedChannel {
    /// Channel, length and share in words: `position over 0.21 s (97 % of its variance)`.
    pub fn says(&self) -> String {
        let length = format!("{}{}", three(self.length), spaced(&self.unit));
        format!("{} over {length} ({} of its variance)", self.channel, percent(self.share))
    }
}

/// What a model leaves that could be correlated noise, whose size nobody gave, in words with the remedy; `predicted` is by that model, which
/// has this name.
pub(crate) fn larger(study: &Study, rows: &Rows, predicted: &[f64], model: &str) -> Vec<String> {
    let says = |LargerNoise { output, factor, noise }| {
        let mut trained = rows.train.iter().map(|i| &rows.rows[*i]);
        let row = trained.find(|row| row.output == output && row.noise_freedom.is_finite())?;
        let (name, unit) = (&study.setup.outputs[output], spaced(&unit(study, row.record, row.channel)));
        let sd = three(factor * row.noise);
        let length = format!("{}{}", three(noise.length), spaced(&study.time_unit));
        Some(format!(
            "what {model} leaves of `{name}` could be noise of {sd}{unit} that is correlated over {length}: the noise \
             that was found leaves out what changes slowly. If the sensor has that, give `noise = {sd}`: only what exceeds it then counts as a gap"
        ))
    };
    larger_noise(rows, predicted).into_iter().filter_map(says).collect()
}

/// All of them in words; empty without any.
pub(crate) fn listed(noise: &[CorrelatedChannel]) -> String {
    noise.iter().map(CorrelatedChannel::says).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_a_channel_is_told_with_its_length_and_share() {
        let of = |channel: &str, unit: &str| {
            let (channel, unit) = (channel.to_owned(), unit.to_owned());
            CorrelatedChannel { channel, share: 0.974, length: 0.2134, unit }
        };
        assert_eq!(
            listed(&[of("position", "s"), of("angle", "")]),
            "position over 0.213 s (97 % of its variance), angle over 0.213 (97 % of its variance)"
        );
        assert_eq!(listed(&[]), "");
    }
}
