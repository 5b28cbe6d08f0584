//! A damped pendulum at large angles, driven by a known torque; only its angle is seen.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
roles = { d = "damping" }
outputs = [{ name = "angle", unit = "rad", role = "displacement", value = "a" }]
inputs = [{ name = "torque", unit = "1/s^2", role = "force" }]
solver = { method = "fixed", step = 0.02 }

[[model.states]]
name = "a"
unit = "rad"
role = "displacement"
initial = 1.0
rate = "w"

[[model.states]]
name = "w"
unit = "rad/s"
role = "velocity"
initial = 0.0
rate = { gravity = "-g_over_l*sin(a)", viscous = "-d*w", drive = "torque" }

[[parameters]]
name = "g_over_l"
unit = "1/s^2"
prior = { transform = "log", median = 9.0, factor = 1.15 }

[[parameters]]
name = "d"
unit = "1/s"
prior = { transform = "log", median = 0.4, factor = 1.3 }

[[parameters]]
name = "initial:a"
unit = "rad"
prior = { transform = "linear", median = 1.0, sd = 0.2 }

[[parameters]]
name = "initial:w"
unit = "rad/s"
prior = { transform = "linear", median = 0.0, sd = 0.5 }
"#;

/// A bristle that yields (Bouc & Wen), and a torque whose frequency climbs.
const ALIENS: &str = r#"
[[effects]]
name = "bristle"
says = "A bearing that yields after a while and remembers where it did."
adds = [ { to = "w", term = "-b_bristle*z_bristle" } ]
states = [ { name = "z_bristle", unit = "rad", initial = 0, rate = "w - abs(w)*z_bristle/y_bristle" } ]
parameters = [ { name = "b_bristle", range = [0, 200] }, { name = "y_bristle", grid = [0.1, 0.4], range = [0.05, 1] } ]

[[effects]]
name = "climbing-torque"
says = "A torque whose frequency climbs through the pendulum's own."
adds = [ { to = "w", term = "b_climb*sin(1.3*t + g_climb*t^2)" } ]
parameters = [ { name = "b_climb", range = [-50, 50] }, { name = "g_climb", grid = [0.05, 0.09], range = [0.01, 0.2] } ]
"#;

/// Damping in a bearing that tightens with the deflection: a form of proposals alone, by whose name it goes.
const UNLISTED: &str = r#"
[[effects]]
name = "size-times:w:a:w"
says = "Damping that grows with the size of the deflection."
adds = [ { to = "w", term = "b_tight*abs(a)*w" } ]
parameters = [ { name = "b_tight", range = [-50, 0] } ]
"#;

/// Tones below the small-angle frequency of 3 rad/s: swings of about one radian that never go over the top, where the smallest
/// difference would decide all that follows.
fn torque(t: f64) -> f64 {
    1.3 * (2.3 * t).sin() + 1.6 * (1.37 * t + 0.7).sin() + 1.5 * (0.53 * t).sin()
}

const TRUTHS: &[Truth] = &[
    truth("coulomb-friction"),
    truth("quadratic-drag"),
    truth("linear-support"),
    truth("cubic-stiffness"),
    truth("quadratic-stiffness"),
    truth("bias-force").same(&[("input-offset", "the torque enters this equation alone")]),
    truth("periodic-forcing"),
    truth("input-gain").same(&[("coupling:w:torque", "the torque enters this equation alone")]),
    truth("sensor-gain"),
];

const ABSORBED: &[Truth] = &[truth("viscous-friction"), truth("gravity-component")];

pub(super) fn system() -> System {
    System {
        name: "pendulum",
        text: TEXT,
        aliens: ALIENS,
        unlisted: UNLISTED,
        span: 30.0,
        inputs: &[("torque", torque)],
        channels: &["angle"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: true,
    }
}
