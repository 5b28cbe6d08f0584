//! Effects of liquid levels: what leaves a tank, what enters it unseen, and what one tank gives to another.
//!
//! A term adds to the rate of a level, so that a coefficient counts per area of the tank; what passes from one tank to another
//! is conserved up to the ratio of their areas. Next file to read: [`super::hydraulics`].

use super::draft::{ANY, Draft, POSITIVE};
use super::place::{EffectPlace, Host};
use super::unit::per_time;
use crate::effect::Scale;
use crate::{EffectDef, Quantity, Role};

/// Where a rim can be, in the course of the level.
const RIM: ([f64; 2], &[f64]) = ([0.05, 0.98], &[0.5, 0.7, 0.85]);

/// The share of what leaves one tank, in the areas' ratio, that arrives in another.
const SHARE: ([f64; 2], &[f64]) = ([0.0, 5.0], &[0.5, 1.0]);

/// Every ordered pair of tanks.
fn tanks(host: Host<'_>) -> Vec<(EffectPlace<'_>, &Quantity, &Quantity)> {
    let levels = host.states(Role::Level);
    host.pairs(&levels, &levels)
}

/// Outflow through a hole at the bottom.
pub(super) fn leak(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Level))
        .into_iter()
        .map(|(place, level)| {
            let (h, c) = (&level.name, place.name("c_leak"));
            Draft::new(&place, "leak", format!("Liquid leaks out through a hole below {h}."))
                .adds(h, format!("-{c}*sqrt(max({h}, 0))"))
                .coefficient(&c, "", POSITIVE, "Outflow at level one, per area of the tank.")
                .confounders(&["linear-leak", "bias-flow", "overflow"])
                .source("Torricelli 1644, De motu gravium, book 2")
        })
        .collect()
}

/// Laminar outflow.
pub(super) fn linear_leak(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Level))
        .into_iter()
        .map(|(place, level)| {
            let (h, c) = (&level.name, place.name("k_leak"));
            Draft::new(&place, "linear-leak", format!("Liquid seeps out in proportion to {h}."))
                .adds(h, format!("-{c}*max({h}, 0)"))
                .coefficient(
                    &c,
                    per_time("", host.time),
                    POSITIVE,
                    "Share of the level that is lost per time.",
                )
                .confounders(&["leak", "bias-flow", "overflow"])
                .source("Poiseuille 1840, C. R. Acad. Sci. 11, 961")
        })
        .collect()
}

/// Outflow over a rim.
pub(super) fn overflow(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Level))
        .into_iter()
        .map(|(place, level)| {
            let (h, q, rim) = (&level.name, place.name("q_over"), place.name("rim"));
            let says = format!("The tank spills over a rim, or reaches a limit, when {h} is high.");
            Draft::new(&place, "overflow", says)
                .adds(h, format!("-{q}*max({h} - {rim}, 0)"))
                .coefficient(&q, per_time("", host.time), POSITIVE, "Spilling rate per height above the rim.")
                .inner(&rim, &level.unit, RIM, Scale::Range(h.clone()), "Height of the rim.")
                .confounders(&["linear-leak", "sensor-saturation"])
                .source("Schoukens and Noel 2017, IFAC-PapersOnLine 50, 446 (cascaded tanks)")
        })
        .collect()
}

/// A constant flow that nobody recorded.
pub(super) fn bias_flow(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Level))
        .into_iter()
        .map(|(place, level)| {
            let (h, q) = (&level.name, place.name("q_bias"));
            Draft::new(
                &place,
                "bias-flow",
                format!("A constant flow changes {h} besides those in the model."),
            )
            .adds(h, q.clone())
            .coefficient(&q, per_time(&level.unit, host.time), ANY, "Flow per area of the tank.")
            .confounders(&["leak", "sensor-offset"])
            .source("Venkatasubramanian, Rengaswamy, Yin and Kavuri 2003, Comput. Chem. Eng. 27, 293")
        })
        .collect()
}

/// A hole from one tank into another.
pub(super) fn leak_into(host: Host<'_>) -> Vec<EffectDef> {
    tanks(host)
        .into_iter()
        .map(|(place, from, into)| {
            let (h, c, share) = (&from.name, place.name("c_into"), place.name("share_leak"));
            Draft::new(
                &place,
                "leak-into",
                format!("Liquid leaks from the tank of {h} into that of {}.", into.name),
            )
            .adds(h, format!("-{c}*sqrt(max({h}, 0))"))
            .adds(&into.name, format!("{share}*{c}*sqrt(max({h}, 0))"))
            .coefficient(&c, "", POSITIVE, "Outflow at level one, per area of the tank.")
            .inner(&share, "", SHARE, Scale::Absolute, "Part that arrives, times the ratio of the areas.")
            .confounders(&["leak", "connection"])
            .source("Torricelli 1644, De motu gravium, book 2")
        })
        .collect()
}

/// Spilling from one tank into another.
pub(super) fn overflow_into(host: Host<'_>) -> Vec<EffectDef> {
    tanks(host)
        .into_iter()
        .map(|(place, from, into)| {
            let h = &from.name;
            let (q, rim, share) = (place.name("q_spill"), place.name("rim_spill"), place.name("share_spill"));
            let says =
                format!("The tank of {h} spills over its rim, part of it into the tank of {}.", into.name);
            Draft::new(&place, "overflow-into", says)
                .adds(h, format!("-{q}*max({h} - {rim}, 0)"))
                .adds(&into.name, format!("{share}*{q}*max({h} - {rim}, 0)"))
                .coefficient(&q, per_time("", host.time), POSITIVE, "Spilling rate per height above the rim.")
                .inner(&rim, &from.unit, RIM, Scale::Range(h.clone()), "Height of the rim.")
                .inner(&share, "", SHARE, Scale::Absolute, "Part that arrives, times the ratio of the areas.")
                .confounders(&["overflow", "leak-into"])
                .source("Schoukens and Noel 2017, IFAC-PapersOnLine 50, 446 (cascaded tanks)")
        })
        .collect()
}

/// A pipe between two tanks, each pair once.
pub(super) fn connection(host: Host<'_>) -> Vec<EffectDef> {
    let order = |q: &Quantity| host.spec.states.iter().position(|s| s.name == q.name);
    tanks(host)
        .into_iter()
        .filter(|(_, one, other)| order(one) < order(other) && one.unit == other.unit)
        .map(|(place, one, other)| {
            let (a, b) = (&one.name, &other.name);
            let (k, ratio) = (place.name("k_pipe"), place.name("ratio_pipe"));
            Draft::new(&place, "connection", format!("A pipe lets {a} and {b} level out."))
                .adds(a, format!("-{k}*({a} - {b})"))
                .adds(b, format!("{ratio}*{k}*({a} - {b})"))
                .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of levelling out.")
                .inner(&ratio, "", ([0.05, 20.0], &[0.5, 1.0, 2.0]), Scale::Absolute, "Ratio of the areas.")
                .confounders(&["linear-leak", "leak-into"])
                .source("Poiseuille 1840, C. R. Acad. Sci. 11, 961")
        })
        .collect()
}
