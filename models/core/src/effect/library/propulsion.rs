//! Effects of rocket motors: throat, grain and nozzle.
//!
//! They find their place by the roles of a model's parameters, `throat-area`, `burn-rate` and `burn-area`, of its state of role
//! `web`, the distance burnt, and of outputs of role `thrust`. Next file to read: [`super::place`].

use super::Grow;
use super::draft::{Draft, POSITIVE};
use super::place::Host;
use super::unit::over;
use crate::effect::Scale;
use crate::{EffectDef, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] =
    &[throat_step, throat_erosion, burn_rate_shift, uneven_burn_out, back_pressure];

/// The throat takes another area at some time.
fn throat_step(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.parameters(Role::ThroatArea))
        .into_iter()
        .map(|(place, area)| {
            let (a, change, when) = (&area.name, place.name("throat_change"), place.name("t_throat"));
            let says = format!("The throat {a} suddenly widens or is partly blocked.");
            Draft::new(&place, "throat-step", says)
                .adds(a, format!("{a}*{change}*step(t - {when})"))
                .coefficient(&change, "", [-0.9, 5.0], "Change as a share of the area.")
                .instant(&when, host.time)
                .confounders(&["throat-erosion", "burn-rate-shift"])
                .source("Sutton and Biblarz 2016, Rocket Propulsion Elements, 9th ed., ch. 15")
        })
        .collect()
}

/// The throat wears, as a power of time.
fn throat_erosion(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.parameters(Role::ThroatArea))
        .into_iter()
        .map(|(place, area)| {
            let a = &area.name;
            let (growth, power, start) =
                (place.name("erosion"), place.name("erosion_power"), place.name("erosion_start"));
            Draft::new(&place, "throat-erosion", format!("The nozzle wears: the throat {a} grows with time."))
                .adds(a, format!("{a}*{growth}*max(t - {start}, 0)^{power}"))
                .coefficient(&growth, "", POSITIVE, "Relative growth in the first unit of time.")
                .inner(&power, "", ([0.5, 4.0], &[1.0, 2.0, 3.0]), Scale::Absolute, "Power of time.")
                .record_start(&start, host.time)
                .confounders(&["throat-step", "uneven-burn-out", "burn-rate-shift"])
                .source("Sutton and Biblarz 2016, Rocket Propulsion Elements, 9th ed., ch. 15")
        })
        .collect()
}

/// The propellant burns faster or slower from some time on.
fn burn_rate_shift(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.parameters(Role::BurnRate))
        .into_iter()
        .map(|(place, rate)| {
            let (r, change, when) = (&rate.name, place.name("burn_change"), place.name("t_burn"));
            let says = "The propellant burns faster or slower from some time on, as with another batch or temperature.";
            Draft::new(&place, "burn-rate-shift", says)
                .adds(r, format!("{r}*{change}*step(t - {when})"))
                .coefficient(&change, "", [-0.9, 5.0], "Change as a share of the burning rate.")
                .instant(&when, host.time)
                .confounders(&["throat-step", "uneven-burn-out"])
                .source("Sutton and Biblarz 2016, Rocket Propulsion Elements, 9th ed., ch. 12")
        })
        .collect()
}

/// Parts of the grain end early, so that the burning surface shrinks before all is burnt.
fn uneven_burn_out(host: Host<'_>) -> Vec<EffectDef> {
    host.pairs(&host.parameters(Role::BurnArea), &host.states(Role::Web))
        .into_iter()
        .map(|(place, area, web)| {
            let (a, w, slope, onset) = (&area.name, &web.name, place.name("tail_off"), place.name("w_tail"));
            let says = "The grain does not burn out everywhere at once: its burning surface shrinks towards the end.";
            Draft::new(&place, "uneven-burn-out", says)
                .adds(a, format!("-{a}*min({slope}*max({w} - {onset}, 0), 1)"))
                .coefficient(&slope, over("1", &web.unit), POSITIVE, "Share of the surface lost per distance burnt.")
                .inner(
                    &onset,
                    &web.unit,
                    ([0.05, 0.98], &[0.4, 0.6, 0.8]),
                    Scale::Range(w.clone()),
                    "Distance burnt when the first parts are burnt out.",
                )
                .confounders(&["throat-erosion", "burn-rate-shift"])
                .source("Sutton and Biblarz 2016, Rocket Propulsion Elements, 9th ed., ch. 12")
        })
        .collect()
}

/// Thrust lacks what the surrounding air takes, at most all of it.
fn back_pressure(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.outputs(Role::Thrust))
        .into_iter()
        .map(|(place, thrust)| {
            let (f, loss) = (&thrust.name, place.name("F_back"));
            let says =
                format!("The pressure of the air on the nozzle's exit takes a constant part of the {f}.");
            Draft::new(&place, "back-pressure", says)
                .adds(&place.output(thrust), format!("-min({loss}, max({f}, 0))"))
                .coefficient(&loss, &thrust.unit, POSITIVE, "Thrust that is lost.")
                .confounders(&["sensor-offset", "sensor-gain"])
                .source("Sutton and Biblarz 2016, Rocket Propulsion Elements, 9th ed., eq. 2-13")
        })
        .collect()
}
