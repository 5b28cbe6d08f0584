//! Effects of levels, pressures and flows; where a pressure or a flow is a blood vessel's, these serve too.
//!
//! What acts on one pressure or flow is here, what acts on levels in [`super::levels`]. Next file to read: [`super::place`].

use super::draft::{ANY, Draft, POSITIVE};
use super::place::Host;
use super::unit::{over, per_time, power, times};
use super::{Grow, levels};
use crate::{EffectDef, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] = &[
    series_resistance,
    inertance,
    quadratic_loss,
    turbulent_friction,
    valve_step,
    valve_drift,
    levels::leak,
    levels::linear_leak,
    levels::overflow,
    levels::bias_flow,
    levels::leak_into,
    levels::overflow_into,
    levels::connection,
];

/// A pressure drop Rs q at the place where a flow enters and its pressure is measured.
fn series_resistance(host: Host<'_>) -> Vec<EffectDef> {
    host.pairs(&host.outputs(Role::Pressure), &host.inputs(Role::Flow))
        .into_iter()
        .map(|(place, pressure, flow)| {
            let (q, resistance) = (&flow.name, place.name("Rs"));
            let says = format!(
                "Part of the pressure is lost in proportion to the {q}: a series resistance, or a characteristic impedance."
            );
            Draft::new(&place, "series-resistance", says)
                .adds(&place.output(pressure), format!("{resistance}*{q}"))
                .coefficient(&resistance, over(&pressure.unit, &flow.unit), POSITIVE, "Series resistance.")
                .confounders(&["inertance", "quadratic-loss", "wall-viscosity", "sensor-gain"])
                .source("Westerhof, Elzinga and Sipkema 1971, J. Appl. Physiol. 31, 776")
        })
        .collect()
}

/// A pressure drop L dq/dt.
fn inertance(host: Host<'_>) -> Vec<EffectDef> {
    host.pairs(&host.outputs(Role::Pressure), &host.inputs(Role::Flow))
        .into_iter()
        .map(|(place, pressure, flow)| {
            let (q, inertance) = (&flow.name, place.name("L"));
            let unit = times(&over(&pressure.unit, &flow.unit), host.time);
            Draft::new(&place, "inertance", format!("Part of the pressure accelerates the {q}."))
                .adds(&place.output(pressure), format!("{inertance}*ddt({q})"))
                .coefficient(&inertance, unit, POSITIVE, "Inertance.")
                .confounders(&["series-resistance", "sensor-delay"])
                .source("Stergiopulos, Westerhof and Westerhof 1999, Am. J. Physiol. 276, H81")
        })
        .collect()
}

/// A pressure drop K q |q|.
fn quadratic_loss(host: Host<'_>) -> Vec<EffectDef> {
    host.pairs(&host.outputs(Role::Pressure), &host.inputs(Role::Flow))
        .into_iter()
        .map(|(place, pressure, flow)| {
            let (q, loss) = (&flow.name, place.name("K_loss"));
            let unit = over(&pressure.unit, &power(&flow.unit, 2));
            let says = format!("Part of the pressure is lost with the square of the {q}, as in a narrowing.");
            Draft::new(&place, "quadratic-loss", says)
                .adds(&place.output(pressure), format!("{loss}*{q}*abs({q})"))
                .coefficient(&loss, unit, POSITIVE, "Loss coefficient.")
                .confounders(&["series-resistance", "sensor-gain"])
                .source("Young and Tsai 1973, J. Biomech. 6, 395, eq. 1")
        })
        .collect()
}

/// A flow that is a state slows down by K q |q|.
fn turbulent_friction(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.states(Role::Flow))
        .into_iter()
        .map(|(place, flow)| {
            let (q, friction) = (&flow.name, place.name("K_turbulent"));
            let unit = over(&per_time(&flow.unit, host.time), &power(&flow.unit, 2));
            Draft::new(&place, "turbulent-friction", format!("Turbulent friction slows the {q} down."))
                .adds(q, format!("-{friction}*{q}*abs({q})"))
                .coefficient(&friction, unit, POSITIVE, "Friction per inertance.")
                .confounders(&["series-resistance"])
                .source("Weisbach 1845, Lehrbuch der Ingenieur- und Maschinen-Mechanik, vol. 1")
        })
        .collect()
}

/// A resistance takes another value from some time on.
fn valve_step(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.parameters(Role::Resistance))
        .into_iter()
        .map(|(place, resistance)| {
            let (r, change, when) = (&resistance.name, place.name("valve_change"), place.name("t_valve"));
            let says = format!("The resistance {r} changes at some time, as when a valve is turned.");
            Draft::new(&place, "valve-step", says)
                .adds(r, format!("{r}*{change}*step(t - {when})"))
                .coefficient(&change, "", [-0.95, 50.0], "Change as a share of the resistance.")
                .instant(&when, host.time)
                .confounders(&["valve-drift", "sensor-drift"])
                .source("Venkatasubramanian, Rengaswamy, Yin and Kavuri 2003, Comput. Chem. Eng. 27, 293")
        })
        .collect()
}

/// A resistance that changes slowly and keeps its sign.
fn valve_drift(host: Host<'_>) -> Vec<EffectDef> {
    host.each(host.parameters(Role::Resistance))
        .into_iter()
        .map(|(place, resistance)| {
            let r = &resistance.name;
            let (rate, start) = (place.name("valve_drift"), place.name("valve_drift_start"));
            let says = format!("The resistance {r} drifts, as when a valve closes slowly or a pipe clogs.");
            Draft::new(&place, "valve-drift", says)
                .adds(r, format!("{r}*(exp({rate}*(t - {start})) - 1)"))
                .coefficient(&rate, per_time("", host.time), ANY, "Relative change per time.")
                .record_start(&start, host.time)
                .confounders(&["valve-step", "sensor-drift"])
                .source("Venkatasubramanian, Rengaswamy, Yin and Kavuri 2003, Comput. Chem. Eng. 27, 293")
        })
        .collect()
}
