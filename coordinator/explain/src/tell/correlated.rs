//! The correlated noise of the recordings, in figures and in words.
//!
//! Next file to read: [`super::words`].

use serde::{Deserialize, Serialize};
use starlings_models::units::spaced;
use starlings_study::Study;

use crate::judge::larger_noise::{LargerNoise, larger as larger_noise};
use crate::number::{percent, three};
use crate::rows::{Row, Rows, unit};

/// Noise that is correlated in time, of the stated size or as large as the residuals, as an Ornstein–Uhlenbeck process is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CorrelatedChannel {
    /// Output name.
    pub channel: String,
    /// Share of the noise's variance that is correlated; the rest is white.
    pub share: f64,
    /// Time over which that correlation falls to 1/e.
    pub length: f64,
    /// Unit of the time.
    pub unit: String,
    /// Its sd, in the channel's unit, where the residuals alone tell it: larger than the noise that was found.
    #[serde(default)]
    pub sd: Option<f64>,
    /// Unit of the channel.
    #[serde(default)]
    pub channel_unit: String,
}

/// The outputs whose noise counts as correlated.
pub(crate) fn correlated_noise(study: &Study, rows: &Rows) -> Vec<CorrelatedChannel> {
    let of = |(output, name): (usize, &String)| {
        let noise = rows.noise.get(output)?.as_ref()?;
        let mut trained = rows.train.iter().map(|i| &rows.rows[*i]).filter(|row| row.output == output);
        let is_grown = |row: &&Row| row.noise > study.records[row.record].channels[row.channel].noise;
        let (row, grown) = (trained.clone().next(), trained.find(is_grown));
        Some(CorrelatedChannel {
            channel: name.clone(),
            share: noise.correlated,
            length: noise.length,
            unit: study.time_unit.clone(),
            sd: grown.map(|row| row.noise),
            channel_unit: row.map_or_else(String::new, |row| unit(study, row.record, row.channel)),
        })
    };
    study.setup.outputs.iter().enumerate().filter_map(of).collect()
}

impl CorrelatedChannel {
    /// Channel, length and share in words, and the size where the residuals alone tell it: `position over 0.21 s (97 % of its variance, sd 2 mm)`.
    pub fn says(&self) -> String {
        let length = format!("{}{}", three(self.length), spaced(&self.unit));
        let size = self.size().map_or_else(String::new, |size| format!(", sd {size}"));
        format!("{} over {length} ({} of its variance{size})", self.channel, percent(self.share))
    }

    /// Its sd with its unit, where the residuals alone tell it.
    fn size(&self) -> Option<String> {
        self.sd.map(|sd| format!("{}{}", three(sd), spaced(&self.channel_unit)))
    }
}

/// What stands and falls with a noise whose size the residuals alone tell, with the remedy.
pub(crate) fn assumed(noise: &[CorrelatedChannel]) -> Vec<String> {
    let says = |of: &CorrelatedChannel| {
        let (sd, size, name) = (three(of.sd?), of.size()?, &of.channel);
        Some(format!(
            "the verdict stands and falls with the noise of `{name}`: {size}, correlated over {}{}, is what its residuals show, and the study \
             states none. If the sensor has that, give `noise = {sd}`; if it has less, give that: what exceeds it is a gap",
            three(of.length),
            spaced(&of.unit)
        ))
    };
    noise.iter().filter_map(says).collect()
}

/// The noise in a sentence, with the condition where its size is that of the residuals; empty without any.
pub(crate) fn sentence(noise: &[CorrelatedChannel]) -> String {
    let is_assumed = noise.iter().any(|of| of.sd.is_some());
    match (listed(noise), is_assumed) {
        (listed, _) if listed.is_empty() => listed,
        (listed, true) => format!(
            " That is if the noise, whose size the study does not state, is correlated in time: {listed}."
        ),
        (listed, false) => format!(" The noise is correlated in time: {listed}."),
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
            CorrelatedChannel {
                channel,
                share: 0.974,
                length: 0.2134,
                unit,
                sd: None,
                channel_unit: "m".to_owned(),
            }
        };
        assert_eq!(
            listed(&[of("position", "s"), of("angle", "")]),
            "position over 0.213 s (97 % of its variance), angle over 0.213 (97 % of its variance)"
        );
        assert_eq!((listed(&[]), sentence(&[])), (String::new(), String::new()));
        let assumed_of = CorrelatedChannel { sd: Some(0.002), ..of("position", "s") };
        assert_eq!(
            sentence(&[assumed_of.clone(), of("angle", "s")]),
            " That is if the noise, whose size the study does not state, is correlated in time: position over 0.213 s (97 % of its variance, sd \
             0.002 m), angle over 0.213 s (97 % of its variance)."
        );
        assert!(
            assumed(&[assumed_of])[0].contains("give `noise = 0.002`")
                && assumed(&[of("angle", "s")]).is_empty()
        );
    }
}
