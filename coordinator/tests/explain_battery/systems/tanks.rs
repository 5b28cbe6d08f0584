//! Three tanks in a row, fed by a pump; the first and the last level are seen.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
constants = { A = 1.0 }
outputs = [
  { name = "first", unit = "dm", role = "level", value = "h1" },
  { name = "last", unit = "dm", role = "level", value = "h3" },
]
inputs = [{ name = "pump", unit = "dm/s", role = "flow" }]
solver = { method = "fixed", step = 0.1 }

[[model.states]]
name = "h1"
unit = "dm"
role = "level"
initial = 4.0
rate = { pump = "pump/A", pipe_12 = "-k1*sign(h1 - h2)*sqrt(abs(h1 - h2))/A" }

[[model.states]]
name = "h2"
unit = "dm"
role = "level"
initial = 2.7
rate = { pipe_12 = "k1*sign(h1 - h2)*sqrt(abs(h1 - h2))/A", pipe_23 = "-k2*sign(h2 - h3)*sqrt(abs(h2 - h3))/A" }

[[model.states]]
name = "h3"
unit = "dm"
role = "level"
initial = 1.3
rate = { pipe_23 = "k2*sign(h2 - h3)*sqrt(abs(h2 - h3))/A", drain = "-k3*sqrt(max(h3, 0))/A" }

[[parameters]]
name = "k1"
unit = "dm^0.5/s"
prior = { transform = "log", median = 0.8, factor = 1.2 }

[[parameters]]
name = "k2"
unit = "dm^0.5/s"
prior = { transform = "log", median = 0.8, factor = 1.2 }

[[parameters]]
name = "k3"
unit = "dm^0.5/s"
prior = { transform = "log", median = 0.8, factor = 1.2 }

[[parameters]]
name = "initial:h1"
unit = "dm"
prior = { transform = "linear", median = 4.0, sd = 0.4 }

[[parameters]]
name = "initial:h2"
unit = "dm"
prior = { transform = "linear", median = 2.7, sd = 0.4 }

[[parameters]]
name = "initial:h3"
unit = "dm"
prior = { transform = "linear", median = 1.3, sd = 0.3 }
"#;

/// A side chamber that fills and empties through a narrow hole, and a bucket poured into the second tank.
const ALIENS: &str = r#"
[[effects]]
name = "side-chamber"
says = "A chamber beside the second tank takes water and gives it back through a narrow hole."
adds = [ { to = "h2", term = "-b_side*(h2 - s_side)" } ]
states = [ { name = "s_side", unit = "dm", initial = 2.7, rate = "(h2 - s_side)/tau_side" } ]
parameters = [ { name = "b_side", range = [0, 20] }, { name = "tau_side", grid = [8, 20], range = [3, 60] } ]

[[effects]]
name = "poured-bucket"
says = "Water is poured into the second tank in the middle of the training span."
adds = [ { to = "h2", term = "b_bucket*exp(-((t - at_bucket)/3)^2)" } ]
parameters = [ { name = "b_bucket", range = [-20, 20] }, { name = "at_bucket", grid = [25, 40], range = [10, 60] } ]
"#;

/// A loss that grows with the cube of the level: a form of proposals alone, by whose name it goes.
const UNLISTED: &str = r#"
[[effects]]
name = "cube:h2:h2"
says = "A loss with the cube of the second level."
adds = [ { to = "h2", term = "b_steep*h2^3" } ]
parameters = [ { name = "b_steep", range = [-50, 0] } ]
"#;

/// A pump that is turned up and down between 0.3 and 2 dm/s.
fn pump(t: f64) -> f64 {
    let slow = (0.11 * t).sin() + 0.7 * (0.29 * t + 1.0).sin() + 0.5 * (0.047 * t + 2.0).sin();
    1.15 + 0.8 * (3.0 * slow).tanh() + 0.1 * (0.61 * t).sin()
}

const TRUTHS: &[Truth] = &[
    truth("leak:h1").inside(&["leak-into:h1:h2", "leak-into:h1:h3"]),
    truth("leak:h2").inside(&["leak-into:h2:h1", "leak-into:h2:h3"]),
    truth("linear-leak:h2"),
    truth("overflow:h1").inside(&["overflow-into:h1:h2", "overflow-into:h1:h3"]),
    truth("overflow:h2").inside(&["overflow-into:h2:h1", "overflow-into:h2:h3"]),
    truth("bias-flow:h1").same(&[("input-offset", "the pump feeds this tank alone")]),
    truth("input-gain").same(&[("coupling:h1:pump", "the pump feeds this tank alone")]),
    truth("sensor-gain:first"),
    truth("sensor-offset:last"),
];

const ABSORBED: &[Truth] = &[truth("leak:h3")];

pub(super) fn system() -> System {
    System {
        name: "tanks",
        text: TEXT,
        aliens: ALIENS,
        unlisted: UNLISTED,
        span: 100.0,
        inputs: &[("pump", pump)],
        channels: &["first", "last"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: true,
    }
}
