//! The noise of a channel: as the study gives it, or from the data.
//!
//! The components of a field are measured by one instrument: they share one standard deviation. Next file to read:
//! [`super::channel`].

use starlings_estimators::{n_third_difference, noise_from_third_differences};

use super::pooled_noise::FOUND;
use super::reader::ChannelReader;
use crate::file::ChannelSection;

/// Least noise beside the largest value, or beside one where all values are smaller, and the largest noise: beyond them squares of
/// errors in units of the noise, or the noise's own, are no numbers.
const LEAST: f64 = 1e-100;
const MOST: f64 = 1e150;

/// What is wrong with a standard deviation that the study gives for these values.
pub(super) fn unusable<'a>(sd: f64, values: impl IntoIterator<Item = &'a f64>) -> Option<String> {
    if sd.is_nan() || sd <= 0.0 {
        return Some(format!("`noise` must be above zero, found {sd}"));
    }
    let size = values.into_iter().filter(|v| v.is_finite()).fold(1.0_f64, |size, v| size.max(v.abs()));
    if sd < LEAST * size {
        return Some(format!("`noise` is so small that squares of errors beside it overflow, found {sd:e}"));
    }
    (sd > MOST).then(|| format!("`noise` is so large that its square overflows, found {sd:e}"))
}

/// A standard deviation and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Noise {
    pub(super) sd: f64,
    pub(super) how: String,
    /// Third differences from which it was found; `None` where it was given.
    pub(super) found_from: Option<usize>,
}

impl ChannelReader<'_> {
    /// The noise of a channel whose components have these values. Held-out rows of a trained record take no part.
    pub(super) fn noise(&self, section: &ChannelSection, parts: &[&[f64]], unit: &str) -> Option<Noise> {
        if let Some(sd) = *section.noise.get_ref() {
            let Some(message) = unusable(sd, parts.iter().copied().flatten()) else {
                return Some(Noise { sd, how: "given in the study".to_owned(), found_from: None });
            };
            let help =
                "give the standard deviation of the measurement error in the channel's unit, or \"auto\"";
            self.source.report_with(section.noise.span(), message, help);
            return None;
        }
        let sds: Vec<f64> =
            parts.iter().map(|values| noise_from_third_differences(&self.used(values))).collect();
        let known: Vec<f64> = sds.iter().copied().filter(|sd| !sd.is_nan()).collect();
        let sd = root_mean_square(&known);
        if sd > 0.0 && sd.is_finite() {
            let n = parts.iter().map(|values| n_third_difference(&self.used(values))).sum();
            return Some(Noise { sd, how: self.found(parts), found_from: Some(n) });
        }
        let why = if known.is_empty() {
            "there are no four samples in a row"
        } else {
            "the samples do not scatter"
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
        let message = format!(
            "the noise of column `{}` cannot be found from the data: {why}",
            section.column.get_ref()
        );
        self.source.report_with(section.noise.span(), message, format!("give its standard deviation{unit}"));
        None
    }

    fn found(&self, parts: &[&[f64]]) -> String {
        let n = parts.first().map_or(0, |values| self.used(values).len());
        let uneven = if self.is_even() { "" } else { " (which are not evenly spaced: it may be too large)" };
        match parts.len() {
            1 => format!("{FOUND}{n} samples{uneven}"),
            of => {
                format!(
                    "from the third differences of the {n} samples of its {of} components, pooled{uneven}"
                )
            }
        }
    }

    /// The values at the rows that count.
    pub(super) fn used(&self, values: &[f64]) -> Vec<f64> {
        let rows = values.iter().zip(&self.table.times);
        rows.filter(|(_, t)| self.is_used(**t)).map(|(v, _)| *v).collect()
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    (sum / values.len().max(1) as f64).sqrt()
}
