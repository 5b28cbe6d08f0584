//! The two-element Windkessel, built in: pressure from a measured flow with beats of unequal length and strength.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
unit = "mmHg s/mL"
prior = { transform = "log", median = 1.1, factor = 1.3 }

[[parameters]]
name = "C"
unit = "mL/mmHg"
prior = { transform = "log", median = 1.4, factor = 1.3 }

[[parameters]]
name = "initial:p"
unit = "mmHg"
prior = { transform = "linear", median = 80.0, sd = 8.0 }
"#;

/// The same equations, for an integrator with a tolerance of its own.
const TWIN: &str = r#"
[model]
kind = "equations"
roles = { R = "resistance", C = "compliance" }
outputs = [{ name = "pressure", unit = "mmHg", role = "pressure", value = "p" }]
inputs = [{ name = "flow", unit = "mL/s", role = "flow" }]

[[model.states]]
name = "p"
unit = "mmHg"
role = "pressure"
initial = 80.0
rate = "(flow - p/R)/C"
"#;

/// A wall that creeps, and a patient who strains at irregular times.
const ALIENS: &str = r#"
[[effects]]
name = "creeping-wall"
says = "Part of the stored volume follows the pressure only after a while."
adds = [ { to = "p", term = "-b_creep*(p - s_creep)" } ]
states = [ { name = "s_creep", unit = "mmHg", initial = 80, rate = "(p - s_creep)/tau_creep" } ]
parameters = [ { name = "b_creep", range = [0, 50] }, { name = "tau_creep", grid = [0.3, 0.9], range = [0.1, 3] } ]

[[effects]]
name = "straining"
says = "The patient strains for a moment now and then."
adds = [ { to = "pressure", term = "b_strain*step(sin(1.1*t + 1) + sin(2.9*t*g_strain) + sin(0.6*t) - 0.8)" } ]
parameters = [ { name = "b_strain", range = [-200, 200] }, { name = "g_strain", grid = [0.9, 1.2], range = [0.5, 2] } ]
"#;

/// Half sines of ejection; interval and stroke change from beat to beat.
fn flow(t: f64) -> f64 {
    let (mut start, mut beat) = (0.0_f64, 0.0_f64);
    loop {
        let length = 0.8 + 0.12 * (1.7 * beat).sin();
        if t < start + length {
            let phase = (t - start) / (0.36 * length);
            let peak = 380.0 * (1.0 + 0.25 * (0.9 * beat + 0.4).sin());
            return if phase < 1.0 { peak * (std::f64::consts::PI * phase).sin() } else { 0.0 };
        }
        start += length;
        beat += 1.0;
    }
}

const TRUTHS: &[Truth] = &[
    truth("series-resistance"),
    truth("inertance"),
    truth("quadratic-loss"),
    truth("nonlinear-compliance"),
    truth("valve-drift"),
    truth("input-delay")
        .same(&[("sensor-delay", "a system that does not depend on time, with a free start")]),
    truth("sensor-lag"),
    truth("valve-step"),
    truth("sensor-saturation"),
];

const ABSORBED: &[Truth] = &[truth("input-gain"), truth("sensor-gain")];

pub(super) fn system() -> System {
    System {
        name: "windkessel",
        text: TEXT,
        aliens: ALIENS,
        unlisted: "",
        span: 10.0,
        inputs: &[("flow", flow)],
        channels: &["pressure"],
        finer: Finer::Twin(TWIN),
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: false,
    }
}
