//! Effects of the recorded inputs: what drives the model differs from what drove the system.
//!
//! Next file to read: [`super::super::scale`].

use super::Grow;
use super::draft::{ANY, Draft};
use super::place::{EffectPlace, Host};
use super::sensors::LONGEST;
use super::unit::per_time;
use crate::effect::Scale;
use crate::{EffectDef, Quantity};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] = &[gain, offset, drift, delay];

/// One effect for every input.
fn every(host: Host<'_>, one: impl Fn(&EffectPlace<'_>, &Quantity) -> EffectDef) -> Vec<EffectDef> {
    host.each(host.all_inputs()).iter().map(|(place, input)| one(place, input)).collect()
}

/// An input that is stronger or weaker than recorded.
fn gain(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, u| {
        let g = place.name("input_gain");
        Draft::new(
            place,
            "input-gain",
            format!("The input {} is stronger than recorded by a constant factor.", u.name),
        )
        .adds(&u.name, format!("{g}*{}", u.name))
        .coefficient(&g, "", [-1.0, f64::INFINITY], "What the record lacks, as a part of the value.")
        .confounders(&["input-offset", "sensor-gain"])
        .source("Söderström 2018, Errors-in-Variables Methods in System Identification")
    })
}

/// A constant error of the recorded input.
fn offset(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, u| {
        let b = place.name("input_offset");
        Draft::new(
            place,
            "input-offset",
            format!("The input {} is larger than recorded by a constant.", u.name),
        )
        .adds(&u.name, b.clone())
        .coefficient(&b, &u.unit, ANY, "What the record lacks.")
        .confounders(&["input-gain", "bias-force", "sensor-offset"])
        .source("Ljung 1999, System Identification, 2nd ed., ch. 14")
    })
}

/// An error of the recorded input that grows from the start of the record.
fn drift(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, u| {
        let (rate, start) = (place.name("input_drift"), place.name("input_drift_start"));
        Draft::new(place, "input-drift", format!("The input {} drifts evenly away from its record.", u.name))
            .adds(&u.name, format!("{rate}*(t - {start})"))
            .coefficient(&rate, per_time(&u.unit, host.time), ANY, "Drift per time.")
            .record_start(&start, host.time)
            .confounders(&["input-offset", "sensor-drift"])
            .source("Ljung 1999, System Identification, 2nd ed., ch. 14")
    })
}

/// An input that takes hold later than it was recorded.
fn delay(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, u| {
        let (tau, name) = (place.name("input_delay"), &u.name);
        Draft::new(place, "input-delay", format!("The input {name} takes hold later than recorded."))
            .adds(name, format!("delay({name}, {tau}) - {name}"))
            .coefficient(&tau, host.time, [0.0, LONGEST], "The delay.")
            .counted_in(Scale::Sampling)
            .confounders(&["sensor-delay", "sensor-lag"])
            .source("Normey-Rico and Camacho 2007, Control of Dead-time Processes")
    })
}
