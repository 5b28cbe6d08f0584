//! Effects of the instruments: what is measured differs from what is there, and the model's course is untouched.
//!
//! Next file to read: [`super::inputs`].

use std::fmt::Write as _;

use super::Grow;
use super::draft::{ANY, Draft};
use super::place::{EffectPlace, Host};
use super::unit::per_time;
use crate::effect::Scale;
use crate::{EffectDef, Quantity};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] = &[offset, step, drift, gain, lag, delay, saturation, quantisation];

/// Longest delay and lag, in sampling intervals: what is longer is seen in the data with the eye.
pub(super) const LONGEST: f64 = 30.0;

/// Cells into which an exponential memory is cut.
const CELLS: u32 = 8;

/// Nodes, in time constants, and weights of the mean of a signal's past under an exponential memory: its mean age within each of n = 8
/// cells, and the share of the memory that lies there. Total weight and mean age are one, so that a steady slope is followed exactly. A
/// signal that bends, as what a switch drives, is followed to 1/(2n²) = 0.8 % of the bend in slope times the time constant: the cells end
/// where e^(−x/2) = 1 − k/n, which makes that error, their length squared times e^(−x)/8, the same in all of them.
fn memory() -> impl Iterator<Item = (f64, f64)> {
    let end = |k: u32| {
        let rest = f64::from(CELLS - k) / f64::from(CELLS);
        // Memory and moment of all that is older, e^(−x) and (x + 1) e^(−x); the last cell has no end.
        let share = rest * rest;
        (share, if k < CELLS { share * (1.0 - share.ln()) } else { 0.0 })
    };
    (0..CELLS).map(move |k| {
        let ((from, age_from), (to, age_to)) = (end(k), end(k + 1));
        ((age_from - age_to) / (from - to), from - to)
    })
}

/// One effect for every output that one number describes.
fn every(host: Host<'_>, one: impl Fn(&EffectPlace<'_>, &Quantity) -> EffectDef) -> Vec<EffectDef> {
    host.each(host.all_outputs()).iter().map(|(place, output)| one(place, output)).collect()
}

/// A constant error.
fn offset(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let b = place.name("sensor_offset");
        Draft::new(place, "sensor-offset", format!("The sensor of {} reads too much by a constant.", y.name))
            .adds(&place.output(y), b.clone())
            .coefficient(&b, &y.unit, ANY, "What is read too much.")
            .confounders(&["bias-force", "sensor-step", "sensor-drift", "sensor-gain"])
            .source("Ljung 1999, System Identification, 2nd ed., ch. 14")
    })
}

/// A constant error from some time on.
fn step(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (b, when) = (place.name("sensor_jump"), place.name("t_sensor_jump"));
        let says = format!(
            "The sensor of {} reads too much by a constant from some time on, as after a knock.",
            y.name
        );
        Draft::new(place, "sensor-step", says)
            .adds(&place.output(y), format!("{b}*step(t - {when})"))
            .coefficient(&b, &y.unit, ANY, "What is read too much from then on.")
            .jump(&when, host.time)
            .confounders(&["sensor-offset", "sensor-drift"])
            .source("Basseville and Nikiforov 1993, Detection of Abrupt Changes, ch. 1")
    })
}

/// An error that grows from the start of the record.
fn drift(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (rate, start) = (place.name("sensor_drift"), place.name("sensor_drift_start"));
        Draft::new(place, "sensor-drift", format!("The sensor of {} drifts evenly with time.", y.name))
            .adds(&place.output(y), format!("{rate}*(t - {start})"))
            .coefficient(&rate, per_time(&y.unit, host.time), ANY, "Drift per time.")
            .record_start(&start, host.time)
            .confounders(&["sensor-offset", "sensor-step", "input-drift"])
            .source("Ljung 1999, System Identification, 2nd ed., ch. 14")
    })
}

/// An error in proportion to the value.
fn gain(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let g = place.name("sensor_gain");
        Draft::new(
            place,
            "sensor-gain",
            format!("The sensor of {} reads too much by a constant factor.", y.name),
        )
        .adds(&place.output(y), format!("{g}*{}", y.name))
        .coefficient(&g, "", [-1.0, f64::INFINITY], "What is read too much, as a part of the value.")
        .confounders(&["sensor-offset", "input-gain", "sensor-saturation"])
        .source("Doebelin 1990, Measurement Systems, 4th ed., ch. 3")
    })
}

/// A sensor of first order: the mean of the past under an exponential memory, by quadrature.
fn lag(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (tau, name) = (place.name("sensor_lag"), &y.name);
        let mut term = String::new();
        for (node, weight) in memory() {
            // Writing to a text does not fail.
            let _ = write!(term, "{weight}*(delay({name}, {node}*{tau}) - {name}) + ");
        }
        let term = term.trim_end_matches(" + ");
        Draft::new(
            place,
            "sensor-lag",
            format!("The sensor of {name} follows slowly, with a lag of first order."),
        )
        .adds(&place.output(y), term)
        .coefficient(&tau, host.time, [0.0, LONGEST], "Time constant of the sensor.")
        .counted_in(Scale::Sampling)
        .confounders(&["sensor-delay", "input-delay"])
        .source("Doebelin 1990, Measurement Systems, 4th ed., ch. 3")
    })
}

/// A sensor that shows the value of then.
fn delay(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (tau, name) = (place.name("sensor_delay"), &y.name);
        Draft::new(place, "sensor-delay", format!("The sensor of {name} answers late by a constant time."))
            .adds(&place.output(y), format!("delay({name}, {tau}) - {name}"))
            .coefficient(&tau, host.time, [0.0, LONGEST], "The delay.")
            .counted_in(Scale::Sampling)
            .confounders(&["sensor-lag", "input-delay"])
            .source("Doebelin 1990, Measurement Systems, 4th ed., ch. 3")
    })
}

/// A sensor at the end of its range: a share of 1 is a hard limit.
fn saturation(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (share, limit, name) = (place.name("sensor_clipped"), place.name("sensor_limit"), &y.name);
        Draft::new(place, "sensor-saturation", format!("The sensor of {name} saturates above a limit."))
            .adds(&place.output(y), format!("-{share}*max({name} - {limit}, 0)"))
            // Room above the hard limit, so that an estimate of 1 does not stand at an edge.
            .coefficient(&share, "", [0.0, 1.5], "Part that is lost above the limit; 1 is a hard limit.")
            .inner(
                &limit,
                &y.unit,
                ([0.0, 1.0], &[0.5, 0.75, 0.9]),
                Scale::Range(name.clone()),
                "Value above which the sensor saturates.",
            )
            .confounders(&["sensor-gain", "sensor-offset"])
            .source("Ljung 1999, System Identification, 2nd ed., ch. 5")
    })
}

/// A sensor that rounds to steps: the first three harmonics of the rounding error.
fn quantisation(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, y| {
        let (share, step, name) = (place.name("sensor_rounded"), place.name("sensor_step"), &y.name);
        let sine = |k: i32| format!("sin({}*pi*{name}/{step})", 2 * k);
        Draft::new(
            place,
            "sensor-quantisation",
            format!("The sensor of {name} rounds its value to whole steps."),
        )
        .adds(&place.output(y), format!("-{share}*{step}/pi*({} - {}/2 + {}/3)", sine(1), sine(2), sine(3)))
        .coefficient(&share, "", [0.0, 1.5], "Part of the rounding error that shows; 1 is all of it.")
        .inner(
            &step,
            &y.unit,
            ([0.02, 2.0], &[0.1, 0.25, 0.5]),
            Scale::Amplitude(name.clone()),
            "Step from one value to the next.",
        )
        .confounders(&["sensor-saturation"])
        .source("Widrow and Kollár 2008, Quantization Noise")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_of_a_lag_follows_a_slope_exactly_and_a_bend_nearly() {
        let sum = |of: fn(f64, f64) -> f64| memory().map(|(node, weight)| of(node, weight)).sum::<f64>();
        assert!(
            (sum(|_, weight| weight) - 1.0).abs() < 1e-14
                && (sum(|x, weight| x * weight) - 1.0).abs() < 1e-14
        );
        // A slope of one that begins at zero is shown as x − 1 + e^(−x).
        for x in (0..800).map(|k| 0.01 * f64::from(k)) {
            let shown: f64 = memory().map(|(node, weight)| weight * (x - node).max(0.0)).sum();
            let error = x - 1.0 + (-x).exp() - shown;
            assert!(error > -1e-12 && error < 1.0 / 128.0, "{x}: {error}");
        }
    }
}
