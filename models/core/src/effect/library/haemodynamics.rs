//! Effects of blood vessels.
//!
//! The characteristic impedance is `series-resistance` of [`super::hydraulics`], and so is the viscosity of a lumped wall, which
//! no recording of pressure and flow tells from it; inertance stands there too. A constant external pressure on a measured
//! pressure is `sensor-offset` of [`super::sensors`]: equal terms are one candidate. Next file to read: [`super::place`].

use super::Grow;
use super::draft::{ANY, Draft, POSITIVE};
use super::place::{EffectPlace, Host};
use super::unit::over;
use crate::effect::Scale;
use crate::{EffectDef, Quantity, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] =
    &[nonlinear_compliance, tissue_support, wall_viscosity, external_pressure];

/// A compliance that falls with pressure and cannot change its sign.
fn nonlinear_compliance(host: Host<'_>) -> Vec<EffectDef> {
    host.matched(&host.parameters(Role::Compliance), &host.states(Role::Pressure))
        .into_iter()
        .map(|(place, compliance, pressure)| {
            let (c, p) = (&compliance.name, &pressure.name);
            let (a, middle) = (place.name("a_stiffening"), place.name("p_stiffening"));
            let says = format!("The vessel stiffens: the compliance {c} falls as {p} rises.");
            Draft::new(&place, "nonlinear-compliance", says)
                .adds(c, format!("{c}*(exp(-{a}*({p} - {middle})) - 1)"))
                .coefficient(&a, over("1", &pressure.unit), POSITIVE, "Relative fall per pressure.")
                .inner(
                    &middle,
                    &pressure.unit,
                    ([0.5, 0.5], &[0.5]),
                    Scale::Range(p.clone()),
                    "Pressure at which the compliance has its own value.",
                )
                .confounders(&["series-resistance", "sensor-gain"])
                .source("Fogliardi, Di Donfrancesco and Burattini 1996, Am. J. Physiol. 271, H2661")
        })
        .collect()
}

/// Parameters of a role that a model leaves at zero.
fn absent(host: Host<'_>, role: Role) -> Vec<(EffectPlace<'_>, &Quantity)> {
    let zero = |q: &&Quantity| q.default.is_some_and(|value| value.abs() < f64::MIN_POSITIVE);
    host.each(host.parameters(role).into_iter().filter(zero).collect())
}

/// Tissue around the vessel resists displacement.
fn tissue_support(host: Host<'_>) -> Vec<EffectDef> {
    absent(host, Role::Stiffness)
        .into_iter()
        .map(|(place, stiffness)| {
            let k = place.name("k_tissue");
            let says = format!("Surrounding tissue supports the wall: {} is not zero.", stiffness.name);
            Draft::new(&place, "tissue-support", says)
                .adds(&stiffness.name, k.clone())
                .coefficient(&k, &stiffness.unit, POSITIVE, "Stiffness of the support.")
                .confounders(&["wall-viscosity", "external-pressure"])
                .source("Moireau, Xiao, Astorino et al. 2012, Biomech. Model. Mechanobiol. 11, 1")
        })
        .collect()
}

/// The wall, or what surrounds it, resists velocity.
fn wall_viscosity(host: Host<'_>) -> Vec<EffectDef> {
    absent(host, Role::Damping)
        .into_iter()
        .map(|(place, damping)| {
            let c = place.name("c_wall");
            let says = format!("The wall or its surroundings are viscous: {} is not zero.", damping.name);
            Draft::new(&place, "wall-viscosity", says)
                .adds(&damping.name, c.clone())
                .coefficient(&c, &damping.unit, POSITIVE, "Viscosity.")
                .confounders(&["tissue-support", "series-resistance"])
                .source("Holenstein, Niederer and Anliker 1980, J. Biomech. Eng. 102, 318")
        })
        .collect()
}

/// A pressure outside the vessel, or where its flow ends, that the model leaves at zero.
fn external_pressure(host: Host<'_>) -> Vec<EffectDef> {
    absent(host, Role::Pressure)
        .into_iter()
        .map(|(place, pressure)| {
            let p = place.name("p_external");
            let says =
                format!("A pressure acts from outside or from the veins: {} is not zero.", pressure.name);
            Draft::new(&place, "external-pressure", says)
                .adds(&pressure.name, p.clone())
                .coefficient(&p, &pressure.unit, ANY, "External pressure.")
                .confounders(&["sensor-offset"])
                .source("Wang, O'Brien, Shrive, Parker and Tyberg 2003, Am. J. Physiol. 284, H1358")
        })
        .collect()
}
