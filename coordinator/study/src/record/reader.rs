//! What is shared while the channels of a record are read, and which of its rows count.
//!
//! Next file to read: [`super::channel`].

use starlings_models::Spec;

use super::Table;
use super::surface_files::SurfaceFiles;
use crate::file::RecordSection;
use crate::problem::Source;

/// Reads the channels of one record.
pub(crate) struct ChannelReader<'a> {
    pub(crate) source: &'a Source,
    pub(crate) section: &'a RecordSection,
    pub(crate) table: &'a Table,
    /// The training span; `None` when the whole record is held out.
    pub(crate) train: Option<[f64; 2]>,
    pub(crate) spec: &'a Spec,
    /// The files of every channel that was measured as a surface.
    pub(super) surfaces: &'a [Option<SurfaceFiles>],
}

impl ChannelReader<'_> {
    /// What the study calls the record.
    pub(super) fn name(&self) -> &str {
        self.section.name.get_ref()
    }

    /// Whether one of the values was measured where the record is used.
    pub(super) fn has_value(&self, values: &[f64]) -> bool {
        values.iter().zip(&self.table.times).any(|(v, t)| v.is_finite() && self.is_used(*t))
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

/// Whether there is a value at all.
pub(super) fn measured_somewhere(values: &[f64]) -> bool {
    values.iter().any(|v| v.is_finite())
}
