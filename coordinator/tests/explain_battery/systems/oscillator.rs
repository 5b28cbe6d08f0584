//! A mass on a linear spring, shaken by a known force; only its position is seen.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
constants = { m = 1.0 }
roles = { m = "inertia", k = "stiffness", c = "damping" }
outputs = [{ name = "position", unit = "m", role = "displacement", value = "x" }]
inputs = [{ name = "force", unit = "N", role = "force" }]
solver = { method = "fixed", step = 0.05 }

[[model.states]]
name = "x"
unit = "m"
role = "displacement"
initial = 0.5
rate = "v"

[[model.states]]
name = "v"
unit = "m/s"
role = "velocity"
initial = 0.0
rate = { spring = "-k*x/m", viscous = "-c*v/m", drive = "force/m" }

[[parameters]]
name = "k"
unit = "N/m"
prior = { transform = "log", median = 4.0, factor = 1.3 }

[[parameters]]
name = "c"
unit = "N s/m"
prior = { transform = "log", median = 0.25, factor = 1.5 }

[[parameters]]
name = "initial:x"
unit = "m"
prior = { transform = "linear", median = 0.5, sd = 0.2 }

[[parameters]]
name = "initial:v"
unit = "m/s"
prior = { transform = "linear", median = 0.0, sd = 0.3 }
"#;

/// A relaxing force of the past velocity (a fluid's history), and blows at irregular times that the record of the force misses.
const ALIENS: &str = r#"
[[effects]]
name = "history-force"
says = "The fluid answers to accelerations of the past."
adds = [ { to = "v", term = "-b_history*(v - s_history)" } ]
states = [ { name = "s_history", unit = "m/s", initial = 0, rate = "(v - s_history)/tau_history" } ]
parameters = [ { name = "b_history", range = [0, 50] }, { name = "tau_history", grid = [0.5, 1.5], range = [0.1, 5] } ]

[[effects]]
name = "telegraph-force"
says = "A push that comes and goes at irregular times."
adds = [ { to = "v", term = "b_telegraph*step(sin(0.71*t + 1) + sin(1.93*t*g_telegraph) + sin(0.37*t) - 0.8)" } ]
parameters = [ { name = "b_telegraph", range = [-50, 50] }, { name = "g_telegraph", grid = [0.9, 1.2], range = [0.5, 2] } ]
"#;

/// Damping that grows with the deflection, and with the cube of the velocity: forms of proposals alone, by whose names they go.
const UNLISTED: &str = r#"
[[effects]]
name = "square-times:v:x:v"
says = "Damping that grows with the square of the deflection."
adds = [ { to = "v", term = "b_deflection*x^2*v" } ]
parameters = [ { name = "b_deflection", range = [-50, 0] } ]

[[effects]]
name = "cube:v:v"
says = "Damping with the cube of the velocity."
adds = [ { to = "v", term = "b_cube*v^3" } ]
parameters = [ { name = "b_cube", range = [-50, 0] } ]
"#;

/// A force of several tones, so that the amplitude wanders.
fn force(t: f64) -> f64 {
    1.1 * (1.3 * t).sin() + 0.9 * (2.17 * t + 1.0).sin() + 0.7 * (0.41 * t + 0.5).sin()
}

const TRUTHS: &[Truth] = &[
    truth("coulomb-friction"),
    truth("quadratic-drag"),
    truth("cubic-stiffness"),
    truth("quadratic-stiffness"),
    truth("dead-zone"),
    truth("backlash"),
    truth("bias-force").same(&[
        ("input-offset", "the force enters this equation alone"),
        ("sensor-offset", "a constant force shifts the rest position of a linear spring"),
    ]),
    truth("periodic-forcing"),
    truth("input-gain").same(&[
        ("sensor-gain", "a linear system answers in proportion, and its start is free"),
        ("coupling:v:force", "the force enters this equation alone"),
        ("added-mass", "the force over the mass, with stiffness and damping free"),
    ]),
    truth("input-delay")
        .same(&[("sensor-delay", "a system that does not depend on time, with a free start")]),
];

const ABSORBED: &[Truth] = &[truth("viscous-friction"), truth("linear-support")];

pub(super) fn system() -> System {
    System {
        name: "oscillator",
        text: TEXT,
        aliens: ALIENS,
        unlisted: UNLISTED,
        span: 50.0,
        inputs: &[("force", force)],
        channels: &["position"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: true,
    }
}
