//! Effects of temperatures: stores and losses that a lumped heat balance leaves out.
//!
//! A term adds to the rate of a temperature, so that a coefficient counts per heat capacity. Next file to read:
//! [`super::place`].

use super::Grow;
use super::draft::{ANY, Draft, POSITIVE};
use super::place::{EffectPlace, Host};
use super::unit::{over, per_time};
use crate::effect::Scale;
use crate::{EffectDef, Quantity, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] =
    &[second_store, loss_to_ambient, convective_loss, gain_from_input, bias_heat];

/// Where the temperature of the surroundings can be, in the course of the temperature.
const SURROUNDINGS: ([f64; 2], &[f64]) = ([-2.0, 2.0], &[-0.1, 0.0, 0.5]);

/// Heat goes into a hidden mass and comes back.
fn second_store(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Temperature))
        .into_iter()
        .map(|(place, temperature)| {
            let (t, k, store) = (&temperature.name, place.name("k_store"), place.name("T_store"));
            let (ratio, start) = (place.name("ratio_store"), place.name("T_store_start"));
            Draft::new(&place, "second-store", format!("A hidden mass stores heat and gives it back to {t}."))
                .adds(t, format!("-{k}*({t} - {store})"))
                .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of exchange.")
                .inner(
                    &ratio,
                    "",
                    ([0.01, 20.0], &[0.2, 1.0]),
                    Scale::Absolute,
                    "Heat capacity over that of the store.",
                )
                .inner(
                    &start,
                    &temperature.unit,
                    ([-1.0, 2.0], &[0.0, 1.0]),
                    Scale::Range(t.clone()),
                    "Temperature of the store at the start.",
                )
                .state(&store, &temperature.unit, start.clone(), format!("{k}*{ratio}*({t} - {store})"))
                .confounders(&["loss-to-ambient", "sensor-lag"])
                .source("Bacher and Madsen 2011, Energy Build. 43, 1511")
        })
        .collect()
}

/// A loss in proportion to the difference from the surroundings.
fn loss_to_ambient(host: Host<'_>) -> Vec<EffectDef> {
    to_surroundings(host, |place, temperature, ambient| {
        let (t, k) = (&temperature.name, place.name("k_loss"));
        let (surroundings, inner) = surroundings(place, ambient, "T_ambient");
        let draft =
            Draft::new(place, "loss-to-ambient", format!("Heat is lost from {t} to the surroundings."))
                .adds(t, format!("-{k}*({t} - {surroundings})"))
                .coefficient(&k, per_time("", host.time), POSITIVE, "Rate of cooling.");
        with_surroundings(draft, inner, temperature)
            .confounders(&["second-store", "convective-loss", "bias-heat"])
            .source("Newton 1701, Phil. Trans. R. Soc. 22, 824")
    })
}

/// A loss that grows faster than the difference from the surroundings.
fn convective_loss(host: Host<'_>) -> Vec<EffectDef> {
    to_surroundings(host, |place, temperature, ambient| {
        let (t, k) = (&temperature.name, place.name("k_convective"));
        let (surroundings, inner) = surroundings(place, ambient, "T_outside");
        let says = format!(
            "Radiation or free convection takes the more heat per degree, the farther {t} is from the surroundings."
        );
        let unit = over(&per_time("", host.time), &temperature.unit);
        let draft = Draft::new(place, "convective-loss", says)
            .adds(t, format!("-{k}*({t} - {surroundings})*abs({t} - {surroundings})"))
            .coefficient(&k, unit, POSITIVE, "Rate of cooling per degree.");
        with_surroundings(draft, inner, temperature)
            .confounders(&["loss-to-ambient", "second-store"])
            .source("Dulong and Petit 1817, Ann. Chim. Phys. 7, 113")
    })
}

/// One effect for each temperature, and for each input that is a temperature if there is one.
fn to_surroundings<'a>(
    host: Host<'a>,
    make: impl Fn(&EffectPlace<'a>, &'a Quantity, Option<&'a Quantity>) -> EffectDef,
) -> Vec<EffectDef> {
    let (states, inputs) = (host.states(Role::Temperature), host.inputs(Role::Temperature));
    if inputs.is_empty() {
        return host.each(states).into_iter().map(|(place, t)| make(&place, t, None)).collect();
    }
    host.pairs(&states, &inputs).into_iter().map(|(place, t, u)| make(&place, t, Some(u))).collect()
}

/// What a term calls the temperature of the surroundings, and the inner parameter where no input gives it.
fn surroundings(place: &EffectPlace<'_>, ambient: Option<&Quantity>, stem: &str) -> (String, Option<String>) {
    ambient.map_or_else(
        || {
            let name = place.name(stem);
            (name.clone(), Some(name))
        },
        |input| (input.name.clone(), None),
    )
}

fn with_surroundings(draft: Draft, inner: Option<String>, temperature: &Quantity) -> Draft {
    let Some(name) = inner else { return draft };
    let scale = Scale::Range(temperature.name.clone());
    draft.inner(&name, &temperature.unit, SURROUNDINGS, scale, "Temperature of the surroundings.")
}

/// An input, such as sunshine, heats.
fn gain_from_input(host: Host<'_>) -> Vec<EffectDef> {
    let causes: Vec<&Quantity> =
        host.all_inputs().into_iter().filter(|input| input.role != Role::Temperature).collect();
    host.pairs(&host.states(Role::Temperature), &causes)
        .into_iter()
        .map(|(place, temperature, input)| {
            let (t, u, c) = (&temperature.name, &input.name, place.name("gain_heat"));
            let unit = over(&per_time(&temperature.unit, host.time), &input.unit);
            Draft::new(
                &place,
                "heat-from-input",
                format!("The {u} heats {t}, as sunshine through a window does."),
            )
            .adds(t, format!("{c}*{u}"))
            .coefficient(&c, unit, POSITIVE, "Heating per input.")
            .confounders(&["input-gain", "sensor-gain", "bias-heat"])
            .source("Madsen and Holst 1995, Energy Build. 22, 67")
        })
        .collect()
}

/// A constant source or sink of heat.
fn bias_heat(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Temperature))
        .into_iter()
        .map(|(place, temperature)| {
            let (t, q) = (&temperature.name, place.name("q_heat"));
            Draft::new(&place, "bias-heat", format!("A constant source or sink of heat acts on {t}."))
                .adds(t, q.clone())
                .coefficient(&q, per_time(&temperature.unit, host.time), ANY, "Heating rate.")
                .confounders(&["loss-to-ambient", "sensor-offset"])
                .source("Bacher and Madsen 2011, Energy Build. 43, 1511")
        })
        .collect()
}
