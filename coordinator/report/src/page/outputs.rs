//! The outputs of a run that have anything to show: scalars, and fields with more components than are drawn one by one.

use starlings_study::field::component_of;

use crate::data::{ChannelPlot, ReportData};

/// Observed components up to which every one of a field is drawn by itself.
const FEW: usize = 3;

/// The channels of one output in one record.
pub(super) enum Output<'a> {
    Scalar(&'a ChannelPlot),
    /// A field with the indices of its components.
    Field(&'a str, Vec<(usize, &'a ChannelPlot)>),
}

/// The first, the middle and the last component.
pub(super) fn examples<'a>(components: &[(usize, &'a ChannelPlot)]) -> [&'a ChannelPlot; 3] {
    [0, components.len() / 2, components.len() - 1].map(|at| components[at].1)
}

/// The outputs that have anything to show, in the order of the data.
pub(super) fn outputs(data: &ReportData) -> Vec<Output<'_>> {
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
