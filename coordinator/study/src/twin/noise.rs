//! How much noise a twin's outputs get.
//!
//! Next file to read: [`super`].

use super::Twin;
use crate::Study;
use crate::field::field_of;

/// Noise sd of every output component, whose noise-free values are `values`.
pub(super) fn standard_deviations(
    study: &Study,
    outputs: &[String],
    values: &[Vec<f64>],
    twin: &Twin,
) -> Vec<f64> {
    let observed = |output: &str| study.setup.outputs.iter().any(|o| field_of(o) == field_of(output));
    let sd = |output: &String| {
        if twin.noise_share > 0.0 && observed(output) {
            twin.noise_share.mul_add(amplitude(output, outputs, values), twin.noise)
        } else {
            twin.noise
        }
    };
    outputs.iter().map(sd).collect()
}

/// Largest difference of highest and lowest value over time among the components of an output's field.
fn amplitude(output: &str, outputs: &[String], values: &[Vec<f64>]) -> f64 {
    let of_field = outputs.iter().zip(values).filter(|(o, _)| field_of(o) == field_of(output));
    of_field.map(|(_, values)| spread(values)).fold(0.0, f64::max)
}

fn spread(values: &[f64]) -> f64 {
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    (highest - lowest).max(0.0)
}

/// The same, once per scalar output or field.
pub(super) fn of_outputs(outputs: &[String], noise: &[f64]) -> Vec<(String, f64)> {
    let mut list: Vec<(String, f64)> = Vec::new();
    for (output, sd) in outputs.iter().zip(noise) {
        if list.last().is_none_or(|(name, _)| name != field_of(output)) {
            list.push((field_of(output).to_owned(), *sd));
        }
    }
    list
}
