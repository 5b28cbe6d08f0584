//! Growth of biomass on a substrate, and its product (Monod 1949), by states without a role, so that no effect with a name of its own
//! finds a place in them: what is missing can be told by generic terms only.

use super::{Finer, System, Truth, truth};

const TEXT: &str = r#"
[model]
kind = "equations"
outputs = [
  { name = "biomass", unit = "g/L", value = "X" },
  { name = "substrate", unit = "g/L", value = "S" },
]
inputs = [{ name = "feed", unit = "g/(L h)" }]
solver = { method = "fixed", step = 0.05 }

[[model.states]]
name = "X"
unit = "g/L"
initial = 0.5
rate = "mu*S/(Ks + S)*X - 0.05*X"

[[model.states]]
name = "S"
unit = "g/L"
initial = 5.0
rate = "feed - mu*S/(Ks + S)*X/Y"

[[model.states]]
name = "P"
unit = "g/L"
initial = 0.0
rate = "a*mu*S/(Ks + S)*X"

[[parameters]]
name = "mu"
unit = "1/h"
prior = { transform = "log", median = 0.35, factor = 1.2 }

[[parameters]]
name = "Ks"
unit = "g/L"
prior = { transform = "log", median = 1.0, factor = 1.2 }

[[parameters]]
name = "Y"
unit = ""
prior = { transform = "log", median = 0.5, factor = 1.2 }

[[parameters]]
name = "a"
unit = ""
prior = { transform = "log", median = 0.3, factor = 1.2 }
"#;

/// Losses that grow with the product: forms of proposals alone, by whose names they go.
const UNLISTED: &str = r#"
[[effects]]
name = "square-times:X:P:X"
says = "A loss of biomass with the square of the product."
adds = [ { to = "X", term = "b_poison*P^2*X" } ]
parameters = [ { name = "b_poison", range = [-50, 0] } ]

[[effects]]
name = "product:S:X:P"
says = "A loss of substrate with biomass times product."
adds = [ { to = "S", term = "b_by*X*P" } ]
parameters = [ { name = "b_by", range = [-50, 0] } ]
"#;

/// A fed reactor.
fn feed(t: f64) -> f64 {
    0.6 + 0.35 * (0.21 * t).sin() + 0.2 * (0.47 * t + 1.0).sin()
}

const TRUTHS: &[Truth] = &[
    truth("loss:X"),
    truth("self-limit:X"),
    truth("interaction:X:P"),
    truth("source:S"),
    truth("loss:S"),
    truth("interaction:X:S"),
    truth("saturation:X"),
    truth("threshold:X"),
];

pub(super) fn system() -> System {
    System {
        name: "reactor",
        text: TEXT,
        aliens: "",
        unlisted: UNLISTED,
        span: 60.0,
        inputs: &[("feed", feed)],
        channels: &["biomass", "substrate"],
        finer: Finer::Tolerance,
        truths: TRUTHS,
        absorbed: &[],
        long: false,
    }
}
