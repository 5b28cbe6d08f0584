//! The measured channels of a record: columns to values, a field's components one by one.
//!
//! Next files to read: [`super::part`] for fields, [`super::noise`], [`super::input`].

use starlings_models::Spec;

use super::part::Part;
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
            let found = self.channel(section, context).unwrap_or_default();
            if let Some(twice) = found.iter().find(|new| channels.iter().any(|c| c.output == new.output)) {
                let message =
                    format!("output `{}` has two channels in record `{}`", twice.output, self.name());
                self.source.report_with(
                    section.output.span(),
                    message,
                    "an output is measured once per record",
                );
            }
            channels.extend(found);
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

    /// The scalar channels of one that is written: one, or those of a field's components that the file has.
    fn channel(&self, section: &ChannelSection, context: &mut Context<'_>) -> Option<Vec<Channel>> {
        let quantity = self.quantity(section)?;
        let parts = self.parts(section, quantity)?;
        let read = |part: Part| Some((self.values(section, &part)?, part));
        let mut measured: Vec<(Vec<f64>, Part)> = parts.into_iter().map(read).collect::<Option<_>>()?;
        // A component without any value is one that the file lacks.
        measured.retain(|(values, _)| measured_somewhere(values));
        if !measured.iter().any(|(values, _)| self.has_value(values)) {
            self.no_value(section, measured.is_empty());
            return None;
        }
        let unit = section.unit.as_ref().map(|u| u.get_ref().clone()).filter(|u| !u.is_empty());
        let label = unit.as_deref().unwrap_or(&quantity.unit);
        let values: Vec<&[f64]> = measured.iter().map(|(values, _)| values.as_slice()).collect();
        let noise = self.noise(section, &values, label)?;
        if noise.how.starts_with("from") {
            context.warnings.push(format!(
                "the noise of `{}` in record `{}` was not given: {} was found {}. Give the sensor's standard \
                 deviation if it is known.",
                section.output.get_ref(),
                self.name(),
                with_unit(noise.sd, label),
                noise.how
            ));
        }
        let channel = |(values, part): (Vec<f64>, Part)| Channel {
            row: context.row(&part.output),
            held_out: context.is_held_out(&part.output),
            output: part.output,
            column: part.column,
            unit: unit.clone(),
            noise: noise.sd,
            noise_how: noise.how.clone(),
            values,
        };
        Some(measured.into_iter().map(channel).collect())
    }

    /// The column's values at every row.
    fn values(&self, section: &ChannelSection, part: &Part) -> Option<Vec<f64>> {
        let column = match self.table.csv.index(&part.column) {
            Ok(column) => column,
            Err((message, help)) => {
                self.source.report_with(section.column.span(), message, help);
                return None;
            }
        };
        self.table.csv.numbers(column).map_err(|problem| self.source.adopt(problem)).ok()
    }

    /// Whether one of the values was measured where the record is used.
    fn has_value(&self, values: &[f64]) -> bool {
        values.iter().zip(&self.table.times).any(|(v, t)| v.is_finite() && self.is_used(*t))
    }

    /// Says that a channel has no value, at all or where it is fitted.
    fn no_value(&self, section: &ChannelSection, at_all: bool) {
        let place = if at_all { "no value" } else { "no value in the training span" };
        self.source.report_with(
            section.column.span(),
            format!("column `{}` of record `{}` has {place}", section.column.get_ref(), self.name()),
            if at_all { "remove the channel" } else { "remove the channel, or move `train`" },
        );
    }

    /// Whether a row counts for the channel: the training span, or everything for a record that is held out.
    pub(super) fn is_used(&self, time: f64) -> bool {
        self.train.is_none_or(|[from, to]| from <= time && time <= to)
    }

    /// Whether the rows that count are evenly spaced, to a percent of their mean distance.
    pub(super) fn is_even(&self) -> bool {
        let times: Vec<f64> = self.table.times.iter().copied().filter(|t| self.is_used(*t)).collect();
        let (Some(first), Some(last)) = (times.first(), times.last()) else { return true };
        let mean = (last - first) / (times.len() - 1).max(1) as f64;
        times.windows(2).all(|w| (w[1] - w[0] - mean).abs() <= 0.01 * mean)
    }
}

fn measured_somewhere(values: &[f64]) -> bool {
    values.iter().any(|v| v.is_finite())
}

fn with_unit(value: f64, unit: &str) -> String {
    let text = format!("{value:.3e}").parse::<f64>().map_or_else(|_| value.to_string(), |v| v.to_string());
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}
