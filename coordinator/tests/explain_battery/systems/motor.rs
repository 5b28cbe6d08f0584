//! A solid-propellant motor without dimensions: a chamber, a grain, a nozzle; pressure and thrust are seen, the web is not.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
constants = { At = 1.0, Ab = 1.0, wall = 6.0, fill = 25.0 }
roles = { At = "throat-area", a = "burn-rate", Ab = "burn-area" }
outputs = [
  { name = "pressure", role = "pressure", value = "p" },
  { name = "thrust", role = "thrust", value = "Cf*At*p" },
]
solver = { method = "fixed", step = 0.004 }

[[model.states]]
name = "p"
role = "pressure"
initial = 0.3
rate = { gas = "fill*a*Ab*(0.75 + 1.6*web - 1.7*web^2 + 0.12*sin(14*web))*max(p, 0)^n", nozzle = "-fill*At*p" }

[[model.states]]
name = "web"
role = "web"
initial = 0.0
rate = "a*max(p, 0)^n/wall"

[[parameters]]
name = "a"
prior = { transform = "log", median = 1.0, factor = 1.12 }

[[parameters]]
name = "n"
prior = { transform = "linear", median = 0.35, sd = 0.04 }

[[parameters]]
name = "Cf"
prior = { transform = "log", median = 1.5, factor = 1.08 }

[[parameters]]
name = "initial:p"
prior = { transform = "linear", median = 0.3, sd = 0.08 }
"#;

/// A piece of the grain that breaks off and burns, and pressure oscillations that grow and die.
const ALIENS: &str = r#"
[[effects]]
name = "broken-piece"
says = "A piece of the grain breaks off and burns within a fraction of a second."
adds = [ { to = "p", term = "b_piece*exp(-((t - at_piece)/0.12)^2)" } ]
parameters = [ { name = "b_piece", range = [-500, 500] }, { name = "at_piece", grid = [1.2, 2.2], range = [0.5, 4] } ]

[[effects]]
name = "chuffing"
says = "Burning comes and goes at irregular times."
adds = [ { to = "p", term = "b_chuff*step(sin(5.1*t + 1) + sin(11.3*t*g_chuff) + sin(2.7*t) - 0.8)" } ]
parameters = [ { name = "b_chuff", range = [-500, 500] }, { name = "g_chuff", grid = [0.9, 1.2], range = [0.5, 2] } ]
"#;

const TRUTHS: &[Truth] = &[
    truth("throat-step"),
    truth("throat-erosion"),
    truth("burn-rate-shift"),
    truth("back-pressure").same(&[("sensor-offset:thrust", "thrust never falls below what is subtracted")]),
    truth("sensor-offset:pressure"),
    truth("sensor-drift:pressure"),
    truth("sensor-drift:thrust"),
    truth("sensor-gain:pressure"),
    truth("sensor-lag:thrust"),
];

const ABSORBED: &[Truth] = &[truth("sensor-gain:thrust")];

pub(super) fn system() -> System {
    System {
        name: "motor",
        text: TEXT,
        aliens: ALIENS,
        unlisted: "",
        span: 5.0,
        inputs: &[],
        channels: &["pressure", "thrust"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: false,
    }
}
