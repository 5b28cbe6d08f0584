//! Effects of moving bodies: friction, springs, loads, inertia.
//!
//! A term adds to the rate of a velocity, so its coefficient counts per mass. Where a force changes with the sign of a
//! velocity it does so over a width of 2 % of the velocity's amplitude: a run then has no events. Next file to read:
//! [`super::sensors`].

use super::Grow;
use super::draft::{ANY, Draft, POSITIVE};
use super::place::{EffectPlace, Host};
use super::unit::{over, per_time, power};
use crate::effect::Scale;
use crate::units::Unit;
use crate::{EffectDef, Quantity, Role};

/// Every effect of this family.
pub(super) const GROWERS: &[Grow] = &[
    viscous_friction,
    coulomb_friction,
    stribeck_friction,
    quadratic_drag,
    linear_support,
    quadratic_stiffness,
    cubic_stiffness,
    dead_zone,
    backlash,
    bias_force,
    periodic_forcing,
    gravity_component,
    added_mass,
];

/// Width of velocity over which a dry friction changes its sign, in amplitudes of the velocity, that is tried first. A body that half of
/// the friction holds at rest creeps with half of this width (tanh⁻¹ ½ = 0.55), so that recordings of small noise tell it: a wrong one
/// would be made up for by a friction that fades, or limits itself.
pub const SIGN_WIDTH: f64 = 0.02;
/// The largest such width, in amplitudes of the velocity.
pub const MOST_SIGN_WIDTH: f64 = 0.05;

/// A displacement with the velocity that changes it.
struct Spring<'a> {
    place: EffectPlace<'a>,
    v: &'a Quantity,
    x: &'a Quantity,
}

/// Every velocity with its displacement.
fn springs(host: Host<'_>) -> Vec<Spring<'_>> {
    let (velocities, displacements) = (host.states(Role::Velocity), host.states(Role::Displacement));
    let pairs = host.matched(&velocities, &displacements).into_iter();
    pairs.map(|(place, v, x)| Spring { place, v, x }).collect()
}

/// The unit of the rate of a quantity over another's unit raised to a power.
fn coefficient(host: Host<'_>, rate_of: &Quantity, per: &Quantity, exponent: i32) -> String {
    over(&per_time(&rate_of.unit, host.time), &power(&per.unit, exponent))
}

/// Viscous friction −c v.
fn viscous_friction(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let c = place.name("c_viscous");
        Draft::new(&place, "viscous-friction", "A friction grows in proportion to the velocity.")
            .adds(&v.name, format!("-{c}*{}", v.name))
            .coefficient(&c, coefficient(host, v, v, 1), POSITIVE, "Viscous friction per mass.")
            .confounders(&["quadratic-drag", "coulomb-friction"])
            .source("Rayleigh 1877, The Theory of Sound, ch. III")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// Dry friction −f sign(v).
fn coulomb_friction(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let (f, width) = (place.name("f_coulomb"), place.name("v_coulomb"));
        let draft =
            Draft::new(&place, "coulomb-friction", "A dry friction of constant size opposes the motion.")
                .adds(&v.name, format!("-{f}*tanh({}/{width})", v.name))
                .coefficient(&f, per_time(&v.unit, host.time), POSITIVE, "Dry friction per mass.");
        sign_width(draft, v, &width)
            .confounders(&["viscous-friction", "stribeck-friction", "backlash"])
            .source("Coulomb 1785, Théorie des machines simples")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// The width over which a friction changes its sign.
fn sign_width(draft: Draft, velocity: &Quantity, name: &str) -> Draft {
    let scale = Scale::Amplitude(velocity.name.clone());
    let says = "Velocity within which the friction changes its sign.";
    draft.rounding(name, &velocity.unit, ([0.0, MOST_SIGN_WIDTH], SIGN_WIDTH), scale, says)
}

/// What dry friction has more near rest, −f sign(v) exp(−(v/v₀)²).
fn stribeck_friction(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let (f, v0, width) = (place.name("f_stribeck"), place.name("v_stribeck"), place.name("w_stribeck"));
        let says = "A dry friction is largest near rest and fades as the velocity grows.";
        let draft = Draft::new(&place, "stribeck-friction", says)
            .adds(&v.name, format!("-{f}*tanh({0}/{width})*exp(-({0}/{v0})^2)", v.name))
            .coefficient(&f, per_time(&v.unit, host.time), POSITIVE, "Friction near rest, per mass.")
            .inner(
                &v0,
                &v.unit,
                ([0.04, 1.0], &[0.1, 0.25, 0.5]),
                Scale::Amplitude(v.name.clone()),
                "Velocity at which the friction has faded to 37 %.",
            );
        sign_width(draft, v, &width)
            .confounders(&["coulomb-friction", "viscous-friction"])
            .source("Stribeck 1902, Z. VDI 46, 1341; Armstrong-Hélouvry et al. 1994, Automatica 30, 1083")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// Drag −c v|v|.
fn quadratic_drag(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let c = place.name("c_quadratic");
        Draft::new(&place, "quadratic-drag", "A drag grows with the square of the velocity.")
            .adds(&v.name, format!("-{c}*{0}*abs({0})", v.name))
            .coefficient(&c, coefficient(host, v, v, 2), POSITIVE, "Drag coefficient per mass.")
            .confounders(&["viscous-friction", "coulomb-friction"])
            .source("Newton 1687, Principia, book II, section II")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// A restoring force −k x.
fn linear_support(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let k = place.name("k_support");
        let says = "A support pushes back in proportion to the displacement.";
        Draft::new(&place, "linear-support", says)
            .adds(&v.name, format!("-{k}*{}", x.name))
            .coefficient(&k, coefficient(host, v, x, 1), POSITIVE, "Stiffness of the support per mass.")
            .confounders(&["cubic-stiffness", "gravity-component", "added-mass"])
            .source("Winkler 1867, Die Lehre von der Elasticität und Festigkeit")
    };
    springs(host).into_iter().map(one).collect()
}

/// An asymmetric spring −k x².
fn quadratic_stiffness(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let k = place.name("k_quadratic");
        let says = "The spring is stiffer to one side than to the other.";
        Draft::new(&place, "quadratic-stiffness", says)
            .adds(&v.name, format!("-{k}*{}^2", x.name))
            .coefficient(&k, coefficient(host, v, x, 2), ANY, "Quadratic stiffness per mass.")
            .confounders(&["bias-force", "cubic-stiffness"])
            .source("Nayfeh and Mook 1979, Nonlinear Oscillations, ch. 2")
    };
    springs(host).into_iter().map(one).collect()
}

/// A hardening or softening spring −k x³.
fn cubic_stiffness(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let k = place.name("k_cubic");
        let says = "The spring hardens, or softens, as the displacement grows.";
        Draft::new(&place, "cubic-stiffness", says)
            .adds(&v.name, format!("-{k}*{}^3", x.name))
            .coefficient(&k, coefficient(host, v, x, 3), ANY, "Cubic stiffness per mass.")
            .confounders(&["linear-support", "dead-zone", "gravity-component"])
            .source("Duffing 1918, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz")
    };
    springs(host).into_iter().map(one).collect()
}

/// A spring with a clearance: −k (x − clip(x, ±d)).
fn dead_zone(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let (k, d) = (place.name("k_zone"), place.name("d_zone"));
        let says = "A spring or stop acts only beyond a clearance.";
        Draft::new(&place, "dead-zone", says)
            .adds(&v.name, format!("-{k}*({0} - max(min({0}, {d}), -{d}))", x.name))
            .coefficient(
                &k,
                coefficient(host, v, x, 1),
                POSITIVE,
                "Stiffness beyond the clearance, per mass.",
            )
            .inner(
                &d,
                &x.unit,
                ([0.02, 1.0], &[0.25, 0.5, 0.75]),
                Scale::Amplitude(x.name.clone()),
                "Half of the clearance.",
            )
            .confounders(&["cubic-stiffness", "linear-support", "backlash"])
            .source("Gelb and Vander Velde 1968, Multiple-Input Describing Functions, ch. 2")
    };
    springs(host).into_iter().map(one).collect()
}

/// A play between displacement and spring. The state is what the play has taken up: it follows the motion and stops at ±b.
fn backlash(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let name = |stem: &str| place.name(stem);
        let (k, b, tau, e) = (name("k_play"), name("b_play"), name("tau_play"), name("play"));
        let says = "The spring follows the displacement with a play: it slackens at every return.";
        Draft::new(&place, "backlash", says)
            .adds(&v.name, format!("{k}*{e}"))
            .coefficient(&k, coefficient(host, v, x, 1), POSITIVE, "Stiffness behind the play, per mass.")
            .inner(
                &b,
                &x.unit,
                ([0.01, 1.0], &[0.1, 0.25, 0.5]),
                Scale::Amplitude(x.name.clone()),
                "Half of the play.",
            )
            .inner(&tau, host.time, ([1.0, 1.0], &[1.0]), Scale::Sampling, "Time in which a stop takes hold.")
            .state(&e, &x.unit, "", format!("{} - ({e} - max(min({e}, {b}), -{b}))/{tau}", v.name))
            .confounders(&["coulomb-friction", "dead-zone"])
            .source("Nordin and Gutman 2002, Automatica 38, 1633")
    };
    springs(host).into_iter().map(one).collect()
}

/// A constant force.
fn bias_force(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let f = place.name("f_bias");
        Draft::new(&place, "bias-force", "A constant force acts all the time.")
            .adds(&v.name, f.clone())
            .coefficient(&f, per_time(&v.unit, host.time), ANY, "Force per mass.")
            .confounders(&["sensor-offset", "input-offset", "quadratic-stiffness"])
            .source("Ljung 1999, System Identification, 2nd ed., ch. 14")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// A harmonic force that no input knows.
fn periodic_forcing(host: Host<'_>) -> Vec<EffectDef> {
    let one = |(place, v): (EffectPlace<'_>, &Quantity)| {
        let (f, period, phase) =
            (place.name("f_periodic"), place.name("T_periodic"), place.name("phase_periodic"));
        Draft::new(&place, "periodic-forcing", "A periodic force acts that no input knows.")
            .adds(&v.name, format!("{f}*sin(2*pi*t/{period} + {phase})"))
            .coefficient(&f, per_time(&v.unit, host.time), ANY, "Amplitude of the force per mass.")
            .inner(
                &period,
                host.time,
                ([0.01, 2.0], &[0.05, 0.1, 0.2, 0.4]),
                Scale::Duration,
                "Period of the force.",
            )
            // With either sign of the amplitude, three phases are never more than 30° off.
            .inner(
                &phase,
                "rad",
                ([-3.2, 3.2], &[-1.05, 0.0, 1.05]),
                Scale::Absolute,
                "Phase of the force at t = 0.",
            )
            .confounders(&["bias-force", "input-gain"])
            .source("Rayleigh 1877, The Theory of Sound, ch. III")
    };
    host.each(host.states(Role::Velocity)).into_iter().map(one).collect()
}

/// The weight of a pendulum, −g sin(x): only where the displacement is an angle.
fn gravity_component(host: Host<'_>) -> Vec<EffectDef> {
    let one = |Spring { place, v, x }: Spring<'_>| {
        let angle = match x.unit.as_str() {
            "rad" => x.name.clone(),
            unit if Unit::parse(unit)?.same(&Unit::parse("deg")?) => format!("pi/180*{}", x.name),
            _ => return None,
        };
        let g = place.name("g_angle");
        let says = "Gravity turns the body with the sine of its angle.";
        let draft = Draft::new(&place, "gravity-component", says)
            .adds(&v.name, format!("-{g}*sin({angle})"))
            .coefficient(&g, per_time(&v.unit, host.time), ANY, "Torque of the weight over the inertia.")
            .confounders(&["linear-support", "cubic-stiffness"]);
        Some(draft.source("Huygens 1673, Horologium Oscillatorium"))
    };
    springs(host).into_iter().filter_map(one).collect()
}

/// Fluid or structure that moves along and adds to a mass: where a model with a velocity has a parameter for its inertia.
fn added_mass(host: Host<'_>) -> Vec<EffectDef> {
    if host.states(Role::Velocity).is_empty() {
        return Vec::new();
    }
    let one = |(place, mass): (EffectPlace<'_>, &Quantity)| {
        let m = place.name("m_added");
        Draft::new(&place, "added-mass", "Something moves along and adds to the inertia.")
            .adds(&mass.name, m.clone())
            .coefficient(&m, &mass.unit, POSITIVE, "The inertia that is added.")
            .confounders(&["linear-support", "input-gain"])
            .source("Lamb 1932, Hydrodynamics, 6th ed., ch. VI")
    };
    host.each(host.parameters(Role::Inertia)).into_iter().map(one).collect()
}
