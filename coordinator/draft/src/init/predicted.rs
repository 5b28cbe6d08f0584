//! What stands for a recording where there is none: courses of the inputs, and outputs that the model predicts.
//!
//! Next file to read: [`super::write`].

use std::f64::consts::TAU;

use starlings_models::{Quantity, Spec};

use super::parts::ChannelPart;

/// Outputs that are measured at most.
const MOST_OUTPUTS: usize = 3;

/// Times and inputs of a prediction.
#[derive(Debug)]
pub(super) struct Prediction {
    pub(super) times: Vec<f64>,
    /// Name and values at the times.
    pub(super) inputs: Vec<(String, Vec<f64>)>,
}

/// A wave around the usual value of an input, twice over the span: a constant would tell little of the model.
pub(super) fn unit_course(input: &Quantity, times: &[f64]) -> Vec<f64> {
    let [lo, hi] = input.range;
    let middle = match (input.default, lo.is_finite() && hi.is_finite()) {
        (Some(value), _) => value,
        (None, true) => f64::midpoint(lo, hi),
        (None, false) => 1.0,
    };
    let size = if middle.abs() > 0.0 { 0.5 * middle } else { 1.0 };
    let (first, last) = (times[0], times[times.len() - 1]);
    let at = |time: &f64| (middle + size * (2.0 * TAU * (time - first) / (last - first)).sin()).clamp(lo, hi);
    times.iter().map(at).collect()
}

/// The first outputs of a model as channels.
pub(super) fn channels_of(spec: &Spec) -> Vec<ChannelPart> {
    let channel = |output: &Quantity| ChannelPart {
        column: output.name.clone(),
        output: output.name.clone(),
        unit: output.unit.clone(),
        noise: None,
        share: 1.0,
    };
    spec.outputs.iter().take(MOST_OUTPUTS).map(channel).collect()
}
