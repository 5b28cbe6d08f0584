//! Terms of no particular physics, for equations of any kind: what a rate may have whatever its quantity means.
//!
//! They are tried after the effects that have a name in their field, since they describe a dependence and say nothing of its cause.
//! The rate of a displacement is a velocity by definition and hosts none. Next file to read: [`super::place`].

use super::Grow;
use super::draft::{ANY, Draft, POSITIVE};
use super::place::{EffectPlace, Host};
use super::unit::{over, per_time};
use crate::effect::Scale;
use crate::{EffectDef, Quantity, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] =
    &[source, loss, growth, self_limit, coupling, interaction, saturation, threshold, hidden_store];

/// Scalar states beyond which a model has too many pairs of quantities to try them all.
const MOST_STATES: usize = 8;

/// The scalar states whose rate may be anything; none of a model with too many.
fn rates(host: Host<'_>) -> Vec<&Quantity> {
    let mut states = host.all_states();
    if states.len() > MOST_STATES {
        states.clear();
    }
    states.retain(|q| q.role != Role::Displacement);
    states
}

/// One effect for every rate.
fn every(host: Host<'_>, one: impl Fn(&EffectPlace<'_>, &Quantity) -> EffectDef) -> Vec<EffectDef> {
    host.each(rates(host)).iter().map(|(place, x)| one(place, x)).collect()
}

/// One effect for every rate and every other state or input.
fn with_others(
    host: Host<'_>,
    one: impl Fn(&EffectPlace<'_>, &Quantity, &Quantity) -> EffectDef,
) -> Vec<EffectDef> {
    let others: Vec<&Quantity> = host.all_states().into_iter().chain(host.all_inputs()).collect();
    host.pairs(&rates(host), &others).iter().map(|(place, x, y)| one(place, x, y)).collect()
}

/// A constant term.
fn source(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let c = place.name("c_source");
        Draft::new(place, "source", format!("A constant source or sink of {}.", x.name))
            .adds(&x.name, c.clone())
            .coefficient(&c, per_time(&x.unit, host.time), ANY, "What it adds per time.")
            .confounders(&["coupling", "loss"])
            .source("Jacquez 1972, Compartmental Analysis in Biology and Medicine")
    })
}

/// A loss in proportion to the quantity.
fn loss(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let k = place.name("k_lost");
        Draft::new(place, "loss", format!("A loss of {0} in proportion to {0}.", x.name))
            .adds(&x.name, format!("-{k}*{}", x.name))
            .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of the loss.")
            .confounders(&["self-limit", "saturation", "sensor-gain"])
            .source("Wilhelmy 1850, Ann. Phys. 157, 413")
    })
}

/// Growth in proportion to the quantity.
fn growth(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let k = place.name("k_growth");
        Draft::new(place, "growth", format!("A growth of {0} in proportion to {0}.", x.name))
            .adds(&x.name, format!("{k}*{}", x.name))
            .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of the growth.")
            .confounders(&["source", "coupling", "sensor-gain"])
            .source("Malthus 1798, An Essay on the Principle of Population")
    })
}

/// A loss that grows with the square of the quantity.
fn self_limit(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let k = place.name("k_limit");
        let unit = over(&per_time("", host.time), &x.unit);
        Draft::new(place, "self-limit", format!("A loss of {0} with the square of {0}.", x.name))
            .adds(&x.name, format!("-{k}*{0}*abs({0})", x.name))
            .coefficient(&k, unit, POSITIVE, "Rate of the loss per size.")
            .confounders(&["loss", "threshold"])
            .source("Verhulst 1838, Corresp. Math. Phys. 10, 113")
    })
}

/// A term in proportion to another quantity.
fn coupling(host: Host<'_>) -> Vec<EffectDef> {
    with_others(host, |place, x, y| {
        let k = place.name("k_coupling");
        let unit = over(&per_time(&x.unit, host.time), &y.unit);
        let says = format!("A source or sink of {} in proportion to {}.", x.name, y.name);
        Draft::new(place, "coupling", says)
            .adds(&x.name, format!("{k}*{}", y.name))
            .coefficient(&k, unit, ANY, "What it adds per time and unit.")
            .confounders(&["interaction", "input-gain"])
            .source("Jacquez 1972, Compartmental Analysis in Biology and Medicine")
    })
}

/// A term in proportion to the product of two quantities.
fn interaction(host: Host<'_>) -> Vec<EffectDef> {
    with_others(host, |place, x, y| {
        let k = place.name("k_interaction");
        let unit = over(&per_time("", host.time), &y.unit);
        let says = format!("A gain or loss of {0} in proportion to {0} times {1}.", x.name, y.name);
        Draft::new(place, "interaction", says)
            .adds(&x.name, format!("{k}*{}*{}", x.name, y.name))
            .coefficient(&k, unit, ANY, "Rate per unit of the other.")
            .confounders(&["coupling", "loss", "growth"])
            .source("Volterra 1926, Nature 118, 558")
    })
}

/// A loss that does not grow beyond a limit.
fn saturation(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let (rate, half) = (place.name("rate_saturated"), place.name("half_saturation"));
        let says = format!("A loss of {0} that saturates as {0} grows.", x.name);
        Draft::new(place, "saturation", says)
            .adds(&x.name, format!("-{rate}*{0}/({half} + abs({0}))", x.name))
            .coefficient(&rate, per_time(&x.unit, host.time), POSITIVE, "Largest rate of the loss.")
            .inner(
                &half,
                &x.unit,
                ([0.02, 5.0], &[0.2, 0.8]),
                Scale::Amplitude(x.name.clone()),
                "Value at which half of that is lost.",
            )
            .confounders(&["loss", "source"])
            .source("Michaelis and Menten 1913, Biochem. Z. 49, 333")
    })
}

/// A loss that begins at a threshold.
fn threshold(host: Host<'_>) -> Vec<EffectDef> {
    every(host, |place, x| {
        let (k, at) = (place.name("k_beyond"), place.name("at_threshold"));
        let says = format!("A loss of {} in proportion to what exceeds a threshold.", x.name);
        Draft::new(place, "threshold", says)
            .adds(&x.name, format!("-{k}*max({} - {at}, 0)", x.name))
            .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of the loss.")
            .inner(
                &at,
                &x.unit,
                ([0.0, 1.0], &[0.25, 0.5, 0.75]),
                Scale::Range(x.name.clone()),
                "Value at which it begins.",
            )
            .confounders(&["self-limit", "loss"])
            .source("Quandt 1958, J. Am. Statist. Assoc. 53, 873")
    })
}

/// An exchange with something that no output shows. A temperature has one with a name of its own.
fn hidden_store(host: Host<'_>) -> Vec<EffectDef> {
    let mut hosts = rates(host);
    hosts.retain(|q| q.role != Role::Temperature);
    host.each(hosts)
        .iter()
        .map(|(place, x)| {
            let (k, hidden) = (place.name("k_hidden"), place.name("hidden"));
            let (ratio, start) = (place.name("ratio_hidden"), place.name("hidden_start"));
            let says = format!("A hidden store takes {} up and gives it back.", x.name);
            Draft::new(place, "hidden-store", says)
                .adds(&x.name, format!("-{k}*({} - {hidden})", x.name))
                .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of exchange.")
                .inner(
                    &ratio,
                    "",
                    ([0.01, 20.0], &[0.2, 1.0]),
                    Scale::Absolute,
                    "What the quantity holds over what the store holds at the same value.",
                )
                .inner(
                    &start,
                    &x.unit,
                    ([-1.0, 2.0], &[0.0, 1.0]),
                    Scale::Range(x.name.clone()),
                    "Value of the store at the start.",
                )
                .state(&hidden, &x.unit, start.clone(), format!("{k}*{ratio}*({} - {hidden})", x.name))
                .confounders(&["threshold", "self-limit", "loss"])
                .source("Teorell 1937, Arch. Int. Pharmacodyn. Ther. 57, 205")
        })
        .collect()
}
