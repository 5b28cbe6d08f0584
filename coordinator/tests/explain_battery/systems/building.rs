//! A heated building of two thermal masses, air and walls; the air's temperature is seen, the sun is recorded but not modelled.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
constants = { Ca = 2.0 }
outputs = [{ name = "indoor", unit = "K", role = "temperature", value = "air" }]
inputs = [
  { name = "ambient", unit = "K", role = "temperature" },
  { name = "heating", unit = "kW" },
  { name = "sun", unit = "kW" },
]
solver = { method = "fixed", step = 0.25 }

[[model.states]]
name = "air"
unit = "K"
role = "temperature"
initial = 20.0
rate = { walls = "(walls - air)/(Ri*Ca)", heating = "heating/Ca" }

[[model.states]]
name = "walls"
unit = "K"
role = "temperature"
initial = 16.0
rate = { air = "(air - walls)/(Ri*Cw)", outside = "(ambient - walls)/(Ro*Cw)" }

[[parameters]]
name = "Ri"
unit = "K/kW"
prior = { transform = "log", median = 1.0, factor = 1.25 }

[[parameters]]
name = "Ro"
unit = "K/kW"
prior = { transform = "log", median = 3.0, factor = 1.25 }

[[parameters]]
name = "Cw"
unit = "kW h/K"
prior = { transform = "log", median = 10.0, factor = 1.25 }

[[parameters]]
name = "initial:air"
unit = "K"
prior = { transform = "linear", median = 20.0, sd = 1.0 }

[[parameters]]
name = "initial:walls"
unit = "K"
prior = { transform = "linear", median = 16.0, sd = 1.5 }
"#;

/// Windows opened at irregular times, and people who come for one evening.
const ALIENS: &str = r#"
[[effects]]
name = "open-windows"
says = "Windows are opened at irregular times."
adds = [ { to = "air", term = "-b_windows*step(sin(0.31*t + 1) + sin(0.83*t*g_windows) + sin(0.17*t) - 0.8)" } ]
parameters = [ { name = "b_windows", range = [-50, 50] }, { name = "g_windows", grid = [0.9, 1.2], range = [0.5, 2] } ]

[[effects]]
name = "party"
says = "A crowd heats the air for one evening."
adds = [ { to = "air", term = "b_party*exp(-((t - at_party)/4)^2)" } ]
parameters = [ { name = "b_party", range = [-50, 50] }, { name = "at_party", grid = [50, 100], range = [20, 150] } ]
"#;

/// Sunshine through windows that let more of a bright sun in: a form of proposals alone, by whose name it goes.
const UNLISTED: &str = r#"
[[effects]]
name = "even-square:air:sun"
says = "Heat with the square of the sunshine."
adds = [ { to = "air", term = "b_bright*sun^2" } ]
parameters = [ { name = "b_bright", range = [0, 50] } ]
"#;

const HOUR: f64 = std::f64::consts::TAU / 24.0;

/// Days of unequal warmth.
fn ambient(t: f64) -> f64 {
    4.0 + 5.0 * (HOUR * (t - 9.0)).sin() + 5.0 * (0.045 * t + 1.0).sin()
}

/// A thermostat's programme with steps smoothed over an hour, and a random-looking part.
fn heating(t: f64) -> f64 {
    4.0 + 2.0 * (3.0 * (HOUR * (t - 6.0)).sin()).tanh() + 1.5 * (0.37 * t).sin() * (0.083 * t).cos()
}

/// Sunshine through the windows on days of unequal cloud.
fn sun(t: f64) -> f64 {
    let day = (t / 24.0).floor();
    let clear = 0.6 + 0.4 * (2.3 * day + 0.5).sin();
    3.0 * clear * (HOUR * (t - 6.0)).sin().max(0.0)
}

const TRUTHS: &[Truth] = &[
    truth("heat-from-input:air:sun"),
    truth("heat-from-input:walls:sun"),
    truth("loss-to-ambient:air:ambient"),
    truth("second-store:air"),
    truth("input-gain:ambient"),
    truth("input-delay:heating"),
    truth("sensor-lag"),
    truth("sensor-drift"),
];

const ABSORBED: &[Truth] = &[truth("loss-to-ambient:walls:ambient"), truth("heat-from-input:walls:heating")];

pub(super) fn system() -> System {
    System {
        name: "building",
        text: TEXT,
        aliens: ALIENS,
        unlisted: UNLISTED,
        span: 240.0,
        inputs: &[("ambient", ambient), ("heating", heating), ("sun", sun)],
        channels: &["indoor"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: false,
    }
}
