//! A mass on a spring that is shaken, seen by one sensor or two.
#![allow(dead_code, missing_docs, unreachable_pub)]

/// What it is: its states and what is not known of it.
const PARTS: &str = r#"
[[model.states]]
name = "x"
unit = "m"
role = "displacement"
initial = 0.01
rate = { motion = "v" }

[[model.states]]
name = "v"
unit = "m/s"
role = "velocity"
initial = 0.0
rate = { push = "gain*push", spring = "-k*x", damping = "-c*v" }

[[parameters]]
name = "gain"
unit = "1"
prior = { transform = "log", median = 1.0, factor = 1.05 }

[[parameters]]
name = "k"
unit = "1/s^2"
prior = { transform = "log", median = 60.0, factor = 1.3 }

[[parameters]]
name = "c"
unit = "1/s"
prior = { transform = "log", median = 1.6, factor = 1.5 }
"#;

/// A study of it with these outputs and channels, and what else it says.
pub fn rig(outputs: &str, channels: &str, more: &str) -> String {
    format!(
        r#"
[study]
name = "rig"
seed = 1
time_unit = "s"
{more}

[model]
kind = "equations"
outputs = [ {outputs} ]
inputs = [ {{ name = "push", unit = "m/s^2" }} ]
{PARTS}
[[records]]
name = "rig"
file = "rig.csv"
inputs = {{ push = "push" }}
channels = [ {channels} ]
train = [0.0, 8.5]
"#
    )
}
