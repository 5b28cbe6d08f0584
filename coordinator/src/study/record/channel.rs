//! The measured channels of a record: columns to values, and the noise of each.
//!
//! Next file to read: [`super::input`].

use starlings_estimators::noise_from_third_differences;
use starlings_models::Spec;

use super::{Context, Table};
use crate::study::checked::Channel;
use crate::study::file::{ChannelSection, RecordSection};
use crate::study::problem::Source;

/// Reads the channels of one record.
pub(in crate::study) struct ChannelReader<'a> {
    pub(in crate::study) source: &'a Source,
    pub(in crate::study) section: &'a RecordSection,
    pub(in crate::study) table: &'a Table,
    /// The training span; `None` when the whole record is held out.
    pub(in crate::study) train: Option<[f64; 2]>,
    pub(in crate::study) spec: &'a Spec,
}

impl ChannelReader<'_> {
    /// All channels, their values still at every row of the file; nothing after a complaint.
    pub(in crate::study) fn channels(&self, context: &mut Context<'_>) -> Option<Vec<Channel>> {
        let before = self.source.count();
        let mut channels: Vec<Channel> = Vec::new();
        for section in &self.section.channels {
            let output = section.output.get_ref();
            if channels.iter().any(|c| c.output == *output) {
                let message = format!("output `{output}` has two channels in record `{}`", self.name());
                self.source.report_with(
                    section.output.span(),
                    message,
                    "an output is measured once per record",
                );
            }
            channels.extend(self.channel(section, context));
        }
        if self.section.channels.is_empty() {
            self.source.report(self.section.span.clone(), format!("record `{}` has no channel", self.name()));
        } else if !self.section.held_out && channels.iter().all(|c| c.held_out) && !channels.is_empty() {
            self.source.report_with(
                self.section.span.clone(),
                format!("every channel of record `{}` is held out: nothing is left to fit", self.name()),
                "remove one from `hold_out_channels`, or hold out the record by `use = \"held-out\"`",
            );
        }
        (self.source.count() == before).then_some(channels)
    }

    fn name(&self) -> &str {
        self.section.name.get_ref()
    }

    fn channel(&self, section: &ChannelSection, context: &mut Context<'_>) -> Option<Channel> {
        let output = section.output.get_ref();
        let Some(quantity) = self.spec.outputs.iter().find(|q| q.name == *output) else {
            let valid: Vec<String> = self.spec.outputs.iter().map(|q| q.name.clone()).collect();
            let message = format!("model `{}` has no output `{output}`", self.spec.kind);
            self.source.report_unknown(section.output.span(), message, &valid);
            return None;
        };
        if quantity.size != 1 {
            let message =
                format!("output `{output}` has {} components; a channel measures one", quantity.size);
            self.source.report(section.output.span(), message);
            return None;
        }
        let values = self.values(section)?;
        let unit = section.unit.as_ref().map(|u| u.get_ref().clone()).filter(|u| !u.is_empty());
        let label = unit.as_deref().unwrap_or(&quantity.unit);
        let (noise, noise_how) = self.noise(section, &values, label)?;
        if noise_how.starts_with("from") {
            context.warnings.push(format!(
                "the noise of `{output}` in record `{}` was not given: {} was found {noise_how}. Give the sensor's \
                 standard deviation if it is known.",
                self.name(),
                with_unit(noise, label)
            ));
        }
        let row = context.outputs.iter().position(|o| o == output).unwrap_or_else(|| {
            context.outputs.push(output.clone());
            context.outputs.len() - 1
        });
        Some(Channel {
            output: output.clone(),
            row,
            column: section.column.get_ref().clone(),
            unit,
            noise,
            noise_how,
            values,
            held_out: context.hold_out.contains(output),
        })
    }

    /// The column's values, at least one of them measured where the record is used.
    fn values(&self, section: &ChannelSection) -> Option<Vec<f64>> {
        let column = match self.table.csv.index(section.column.get_ref()) {
            Ok(column) => column,
            Err((message, help)) => {
                self.source.report_with(section.column.span(), message, help);
                return None;
            }
        };
        let values = match self.table.csv.numbers(column) {
            Ok(values) => values,
            Err(problem) => {
                self.source.adopt(problem);
                return None;
            }
        };
        if values.iter().zip(&self.table.times).any(|(v, t)| v.is_finite() && self.is_used(*t)) {
            return Some(values);
        }
        let whole = values.iter().all(|v| v.is_nan());
        let place = if whole { "no value" } else { "no value in the training span" };
        self.source.report_with(
            section.column.span(),
            format!("column `{}` of record `{}` has {place}", section.column.get_ref(), self.name()),
            if whole { "remove the channel" } else { "remove the channel, or move `train`" },
        );
        None
    }

    /// Whether a row counts for the channel: the training span, or everything for a record that is held out.
    fn is_used(&self, time: f64) -> bool {
        self.train.is_none_or(|[from, to]| from <= time && time <= to)
    }

    /// Whether the rows that count are evenly spaced, to a percent of their mean distance.
    fn is_even(&self) -> bool {
        let times: Vec<f64> = self.table.times.iter().copied().filter(|t| self.is_used(*t)).collect();
        let (Some(first), Some(last)) = (times.first(), times.last()) else { return true };
        let mean = (last - first) / (times.len() - 1).max(1) as f64;
        times.windows(2).all(|w| (w[1] - w[0] - mean).abs() <= 0.01 * mean)
    }

    /// Noise sd and how it was found. Held-out rows of a trained record take no part.
    fn noise(&self, section: &ChannelSection, values: &[f64], unit: &str) -> Option<(f64, String)> {
        if let Some(given) = *section.noise.get_ref() {
            if given > 0.0 {
                return Some((given, "given in the study".to_owned()));
            }
            let message = format!("`noise` must be above zero, found {given}");
            let help =
                "give the standard deviation of the measurement error in the channel's unit, or \"auto\"";
            self.source.report_with(section.noise.span(), message, help);
            return None;
        }
        let used: Vec<f64> = values
            .iter()
            .zip(&self.table.times)
            .filter(|(_, t)| self.is_used(**t))
            .map(|(v, _)| *v)
            .collect();
        let sd = noise_from_third_differences(&used);
        if sd > 0.0 && sd.is_finite() {
            let uneven =
                if self.is_even() { "" } else { " (which are not evenly spaced: it may be too large)" };
            return Some((sd, format!("from the third differences of its {} samples{uneven}", used.len())));
        }
        let why =
            if sd.is_nan() { "there are no four samples in a row" } else { "the samples do not scatter" };
        let unit = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
        let message = format!(
            "the noise of column `{}` cannot be found from the data: {why}",
            section.column.get_ref()
        );
        self.source.report_with(section.noise.span(), message, format!("give its standard deviation{unit}"));
        None
    }
}

fn with_unit(value: f64, unit: &str) -> String {
    let text = format!("{value:.3e}").parse::<f64>().map_or_else(|_| value.to_string(), |v| v.to_string());
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}
