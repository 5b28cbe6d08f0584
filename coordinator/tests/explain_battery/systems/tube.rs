//! An artery as an elastic tube of a few cells, built in: the wall's displacement in the middle and the pressure at the inlet are
//! seen. The flow beats regularly with slow changes.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "fsi-tube"
layout = { cells = 6, regions = 2, step = 2e-3 }

[[parameters]]
name = "E1"
unit = "dyn/cm^2"
prior = { transform = "log", median = 5e6, factor = 1.3 }

[[parameters]]
name = "E2"
unit = "dyn/cm^2"
prior = { transform = "log", median = 5e6, factor = 1.3 }

[[parameters]]
name = "R_d"
unit = "dyn s/cm^5"
prior = { transform = "log", median = 1850.0, factor = 1.2 }

[[parameters]]
name = "C"
unit = "cm^5/dyn"
prior = { transform = "log", median = 1e-3, factor = 1.2 }

[[parameters]]
name = "p0"
unit = "dyn/cm^2"
prior = { transform = "log", median = 106000.0, factor = 1.1 }

[[effects]]
name = "proximal-loss"
says = "The outlet has more resistance before its compliance than assumed."
adds = [ { to = "R_p", term = "more_rp" } ]
parameters = [ { name = "more_rp", unit = "dyn s/cm^5", range = [-140, 5000] } ]

[[effects]]
name = "thicker-blood"
says = "The fluid is more viscous than assumed."
adds = [ { to = "mu", term = "more_mu" } ]
parameters = [ { name = "more_mu", unit = "P", range = [-0.03, 50] } ]

[[effects]]
name = "pressure-dependent-compliance"
says = "The periphery stiffens with pressure."
adds = [ { to = "C", term = "C*(exp(-a_c*(pi - 1e5)/1e5) - 1)" } ]
parameters = [ { name = "a_c", range = [-5, 5] } ]

[[effects]]
name = "collateral"
says = "Some blood leaves through vessels besides the outlet's resistance, against a venous pressure."
adds = [ { to = "pi", term = "b_venous/(R_d*C)" } ]
parameters = [ { name = "b_venous", unit = "dyn/cm^2", range = [-1e5, 1e5] } ]
"#;

/// A periphery that narrows at irregular times, and a pressure line that is flushed once.
const ALIENS: &str = r#"
[[effects]]
name = "vasospasm"
says = "The periphery narrows at irregular times."
adds = [ { to = "pi", term = "b_spasm*step(sin(1.1*t + 1) + sin(2.9*t*g_spasm) + sin(0.6*t) - 0.8)" } ]
parameters = [ { name = "b_spasm", range = [-1e9, 1e9] }, { name = "g_spasm", grid = [0.9, 1.2], range = [0.5, 2] } ]

[[effects]]
name = "flush"
says = "The pressure line is flushed once."
adds = [ { to = "inlet_pressure", term = "b_flush*exp(-((t - at_flush)/0.1)^2)" } ]
parameters = [ { name = "b_flush", range = [-1e7, 1e7] }, { name = "at_flush", grid = [1, 2.2], range = [0.5, 4] } ]
"#;

/// Half sines of 300 mL/s every 0.8 s, the strength changing slowly.
fn flow(t: f64) -> f64 {
    let beat = (t / 0.8).floor();
    let phase = (t - 0.8 * beat) / 0.3;
    let peak = 300.0 * (1.0 + 0.2 * (0.9 * beat + 0.4).sin());
    if phase < 1.0 { peak * (std::f64::consts::PI * phase).sin() } else { 0.0 }
}

const TRUTHS: &[Truth] = &[
    truth("tissue-support"),
    truth("wall-viscosity"),
    truth("proximal-loss"),
    truth("thicker-blood"),
    truth("valve-step:R_d"),
    truth("series-resistance:inlet_pressure:flow"),
    truth("quadratic-loss:inlet_pressure:flow"),
    truth("sensor-lag:inlet_pressure"),
    truth("sensor-drift:inlet_pressure"),
];

const ABSORBED: &[Truth] = &[truth("pressure-dependent-compliance")];

pub(super) fn system() -> System {
    System {
        name: "tube",
        text: TEXT,
        aliens: ALIENS,
        unlisted: "",
        span: 5.0,
        inputs: &[("flow", flow)],
        channels: &["inlet_pressure", "displacement[2]"],
        finer: Finer::LayoutStep(2.5e-4),
        truths: TRUTHS,
        absorbed: ABSORBED,
        long: false,
    }
}
