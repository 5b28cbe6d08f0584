//! Small imagined models that have, among them, a place for every built-in effect: the catalogue is grown from them.
//!
//! They are never run. Next file to read: [`super::place`].

use crate::{Quantity, Role, Spec};

/// The imagined models, those with one place of a kind first.
pub(super) fn specimens() -> Vec<Spec> {
    vec![body(), pendulum(), tank(), two_tanks(), vessel(), room(), chamber()]
}

fn q(name: &str, unit: &str, role: Role) -> Quantity {
    Quantity::new(name, unit).role(role)
}

fn model(
    states: Vec<Quantity>,
    parameters: Vec<Quantity>,
    outputs: Vec<Quantity>,
    inputs: Vec<Quantity>,
) -> Spec {
    let (kind, says, measures) = (String::new(), String::new(), Vec::new());
    Spec { kind, says, states, parameters, outputs, inputs, measures, restart: true }
}

fn body() -> Spec {
    model(
        vec![q("x", "m", Role::Displacement), q("v", "m/s", Role::Velocity)],
        vec![q("m", "kg", Role::Inertia)],
        vec![q("y", "m", Role::Displacement)],
        vec![q("u", "N", Role::Force)],
    )
}

fn pendulum() -> Spec {
    let states = vec![q("angle", "rad", Role::Displacement), q("speed", "rad/s", Role::Velocity)];
    model(states, Vec::new(), Vec::new(), Vec::new())
}

fn tank() -> Spec {
    model(
        vec![q("h", "m", Role::Level)],
        vec![q("R", "s/m^2", Role::Resistance)],
        Vec::new(),
        vec![q("q", "m^3/s", Role::Flow)],
    )
}

fn two_tanks() -> Spec {
    let states = vec![q("h1", "m", Role::Level), q("h2", "m", Role::Level)];
    model(states, Vec::new(), Vec::new(), Vec::new())
}

fn vessel() -> Spec {
    let absent =
        |name: &str, unit: &str, role: Role| q(name, unit, role).range(0.0, f64::INFINITY).default(0.0);
    model(
        vec![q("p", "mmHg", Role::Pressure), q("i", "mL/s", Role::Flow)],
        vec![
            q("R", "mmHg s/mL", Role::Resistance),
            q("C", "mL/mmHg", Role::Compliance),
            absent("k_s", "dyn/cm^3", Role::Stiffness),
            absent("c_s", "dyn s/cm^3", Role::Damping),
            absent("p_0", "mmHg", Role::Pressure),
        ],
        vec![q("pressure", "mmHg", Role::Pressure)],
        vec![q("flow", "mL/s", Role::Flow)],
    )
}

fn room() -> Spec {
    model(
        vec![q("T", "K", Role::Temperature)],
        Vec::new(),
        vec![q("reading", "K", Role::Temperature)],
        vec![q("sun", "W/m^2", Role::Other)],
    )
}

fn chamber() -> Spec {
    model(
        vec![q("p", "bar", Role::Pressure), q("w", "mm", Role::Web)],
        vec![
            q("At", "mm^2", Role::ThroatArea),
            q("a", "mm/s", Role::BurnRate),
            q("Ab", "mm^2", Role::BurnArea),
        ],
        vec![q("pressure", "bar", Role::Pressure), q("thrust", "N", Role::Thrust)],
        Vec::new(),
    )
}
