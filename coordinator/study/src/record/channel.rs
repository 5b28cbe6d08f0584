//! The measured channels of a record: columns to values, a field's components one by one.
//!
//! Next files to read: [`super::part`] for fields, [`super::noise`], [`super::input`].

use starlings_models::quoted_list;
use starlings_models::units::{rounded, spaced};

use super::Context;
use super::derived::Derived;
use super::found_noise::FoundNoise;
use super::noise::Noise;
use super::part::Part;
use super::reader::{ChannelReader, measured_somewhere};
use crate::checked::Channel;
use crate::file::ChannelSection;

impl ChannelReader<'_> {
    /// All channels, their values still at every row of the file; `None` when a problem was reported.
    pub(crate) fn channels(&self, context: &mut Context<'_>) -> Option<Vec<Channel>> {
        let before = self.source.count();
        let mut channels: Vec<Channel> = Vec::new();
        for (section, files) in self.section.channels.iter().zip(self.surfaces) {
            let found = match (&section.surface, files) {
                (Some(surface), Some(files)) => self.surface(section, surface, files, context),
                _ => self.channel(section, context),
            };
            let found = found.unwrap_or_default();
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

    /// The scalar channels of one that is written: one, or those of a field's components that the file has.
    fn channel(&self, section: &ChannelSection, context: &mut Context<'_>) -> Option<Vec<Channel>> {
        let quantity = self.quantity(section)?;
        let parts = self.parts(section, quantity)?;
        let derived = self.derived(section)?;
        let read = |part: Part| Some((self.values(section, &part)?, part));
        let mut measured: Vec<(Vec<f64>, Part)> = parts.into_iter().map(read).collect::<Option<_>>()?;
        // A component without any value is treated like one that the file lacks.
        context.warnings.extend(self.empty_columns(&measured));
        measured.retain(|(values, _)| measured_somewhere(values));
        context.warnings.extend(self.leave_out(section, &mut measured));
        if !measured.iter().any(|(values, _)| self.has_value(&self.derive(derived, values))) {
            self.no_value(section, measured.is_empty());
            return None;
        }
        let written = section.unit.as_ref().map(|u| u.get_ref().clone()).filter(|u| !u.is_empty());
        let columns: Vec<&[f64]> = measured.iter().map(|(values, _)| values.as_slice()).collect();
        let label = written.as_deref().unwrap_or(&quantity.unit);
        let found = self.noise(section, &columns, label)?;
        context.found_noise.extend(self.found_noise(section, &found, label));
        let noise = self.derived_noise(derived, &columns, found);
        context.warnings.extend(self.derived_warning(section, derived, &noise, &quantity.unit));
        // A unit belongs to the column; what is derived from it is in the output's.
        let unit = written.filter(|_| derived == Derived::Itself);
        let channel = |(values, part): (Vec<f64>, Part)| Channel {
            row: context.row(&part.output),
            held_out: section.held_out || context.is_held_out(&part.output),
            output: part.output,
            column: part.column,
            unit: unit.clone(),
            noise: noise.sd,
            noise_how: noise.how.clone(),
            noise_found_from: noise.found_from,
            values: self.derive(derived, &values),
            node: None,
        };
        Some(measured.into_iter().map(channel).collect())
    }

    /// Columns of a field that are there but empty may be a slip.
    fn empty_columns(&self, measured: &[(Vec<f64>, Part)]) -> Option<String> {
        let empty = measured.iter().filter(|(values, _)| !measured_somewhere(values));
        let names: Vec<&str> = empty.map(|(_, part)| part.column.as_str()).collect();
        let (n, of) = (names.len(), measured.len());
        (n > 0 && n < of).then(|| {
            let names = quoted_list(&names);
            format!(
                "record `{}` has no value in {names}: {} of {of} columns are observed",
                self.name(),
                of - n
            )
        })
    }

    /// A noise that the study does not give.
    fn found_noise(&self, section: &ChannelSection, noise: &Noise, label: &str) -> Option<FoundNoise> {
        noise.found_from.is_some().then(|| FoundNoise {
            output: section.output.get_ref().clone(),
            record: self.name().to_owned(),
            sd: noise.sd,
            unit: label.to_owned(),
            how: noise.how.clone(),
            is_uneven: !self.is_even(),
        })
    }

    /// The noise of what is derived from columns of this noise.
    fn derived_noise(&self, derived: Derived, columns: &[&[f64]], column: Noise) -> Noise {
        let Some(first) = columns.first().filter(|_| derived != Derived::Itself) else { return column };
        let (spread, last) = self.spread(derived, first);
        let how = match derived {
            Derived::Integral => format!("a centred difference of values with {:.3e} each", column.sd),
            _ => format!(
                "{:.3e} at the end, where the errors of {:.3e} of all rates have added up; the root mean square over the \
                 record",
                column.sd * last,
                column.sd
            ),
        };
        Noise { sd: column.sd * spread, how, ..column }
    }

    fn derived_warning(
        &self,
        section: &ChannelSection,
        derived: Derived,
        noise: &Noise,
        unit: &str,
    ) -> Option<String> {
        let (output, column, sd) =
            (section.output.get_ref(), section.column.get_ref(), with_unit(noise.sd, unit));
        let made = match derived {
            Derived::Itself => return None,
            Derived::Rate { .. } => "integrated",
            Derived::Integral => "differentiated",
        };
        Some(format!(
            "`{output}` in record `{}` is column `{column}` {made}: its noise is taken as {sd} ({}), and its errors are \
             not independent in time: intervals are approximate.",
            self.name(),
            noise.how
        ))
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

    /// Says that a channel has no value, at all or where it is fitted.
    fn no_value(&self, section: &ChannelSection, at_all: bool) {
        let place = if at_all { "no value" } else { "no value in the training span" };
        self.source.report_with(
            section.column.span(),
            format!("column `{}` of record `{}` has {place}", section.column.get_ref(), self.name()),
            if at_all { "remove the channel" } else { "remove the channel, or move `train`" },
        );
    }
}

pub(super) fn with_unit(value: f64, unit: &str) -> String {
    format!("{}{}", rounded(value, 4), spaced(unit))
}
