//! Which figures the outputs get: each scalar its own, a field a few of its components and one map of all residuals.
//!
//! Next file to read: `plot/field_map.rs`.

use starlings_study::field::component_of;

use super::ReportError;
use super::data::{Autocorrelation, ChannelPlot, ReportData};
use super::plot::figure::Figure;
use super::plot::{autocorrelation, field_map, fit, residual};

/// Observed components up to which every one of a field is drawn by itself.
const FEW: usize = 3;

/// The channels of one output in one record.
enum Output<'a> {
    Scalar(&'a ChannelPlot),
    /// A field with the indices of its components.
    Field(&'a str, Vec<(usize, &'a ChannelPlot)>),
}

/// Predicted against measured.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn fits(data: &ReportData) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    for output in outputs(data) {
        match output {
            Output::Scalar(channel) => figures.push(fit::figure(channel, &data.time_unit)?),
            Output::Field(_, components) => {
                for channel in examples(&components) {
                    figures.push(fit::figure(channel, &data.time_unit)?);
                }
            }
        }
    }
    Ok(figures)
}

/// The residuals, each followed by its autocorrelation; of a field the map, and the autocorrelation at its middle.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn residuals(data: &ReportData) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    for output in outputs(data) {
        match output {
            Output::Scalar(channel) => {
                figures.push(residual::figure(channel, &data.time_unit)?);
                figures.extend(correlogram(channel, data)?);
            }
            Output::Field(field, components) => {
                figures.push(field_map::figure(field, &components, &data.time_unit)?);
                figures.extend(correlogram(examples(&components)[1], data)?);
            }
        }
    }
    Ok(figures)
}

fn correlogram(channel: &ChannelPlot, data: &ReportData) -> Result<Option<Figure>, ReportError> {
    let same = |a: &&Autocorrelation| a.record == channel.record && a.channel == channel.channel;
    let found = data.autocorrelation.iter().find(same).filter(|a| !a.value.is_empty());
    found.map(|series| autocorrelation::figure(series, &data.time_unit)).transpose()
}

/// The first, the middle and the last component.
fn examples<'a>(components: &[(usize, &'a ChannelPlot)]) -> [&'a ChannelPlot; 3] {
    [0, components.len() / 2, components.len() - 1].map(|at| components[at].1)
}

/// The outputs that have anything to show, in the order of the data.
fn outputs(data: &ReportData) -> Vec<Output<'_>> {
    let mut list = Vec::new();
    let shown: Vec<&ChannelPlot> = data.channels.iter().filter(|c| !c.time.is_empty()).collect();
    let key = |c: &ChannelPlot| component_of(&c.channel).map(|(field, _)| field.to_owned());
    for group in shown.chunk_by(|a, b| a.record == b.record && key(a).is_some() && key(a) == key(b)) {
        let components: Vec<(usize, &ChannelPlot)> =
            group.iter().filter_map(|c| Some((component_of(&c.channel)?.1, *c))).collect();
        match group.first().and_then(|c| component_of(&c.channel)) {
            Some((field, _)) if group.len() > FEW => list.push(Output::Field(field, components)),
            _ => list.extend(group.iter().map(|c| Output::Scalar(c))),
        }
    }
    list
}
