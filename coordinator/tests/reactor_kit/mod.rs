//! Growth of biomass on a substrate, and its product, after Monod (1949): a model without death of cells, and recordings in
//! which cells die.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

use starlings_coordinator::study::twin::{Twin, simulate};

use crate::study_kit::{Case, csv, grid, normals};

/// Noise sd of biomass, substrate and product.
pub const NOISE: [f64; 3] = [0.05, 0.1, 0.03];

const STUDY: &str = r#"
[study]
name = "reactor"
seed = 1
time_unit = "h"

[model]
kind = "equations"
outputs = [
  { name = "biomass", unit = "g/L", value = "X" },
  { name = "substrate", unit = "g/L", value = "S" },
  { name = "product", unit = "g/L", value = "P" },
]

[[model.states]]
name = "X"
unit = "g/L"
initial = 0.2
rate = "mu*max(S, 0)/(Ks + max(S, 0))*X"

[[model.states]]
name = "S"
unit = "g/L"
initial = 10.0
rate = "-mu*max(S, 0)/(Ks + max(S, 0))*X/Y"

[[model.states]]
name = "P"
unit = "g/L"
initial = 0.0
rate = "(a*mu*max(S, 0)/(Ks + max(S, 0)) + b)*X"

[[parameters]]
name = "mu"
unit = "1/h"
prior = { transform = "log", median = 0.35, factor = 1.3 }

[[parameters]]
name = "Ks"
unit = "g/L"
prior = { transform = "log", median = 0.5, factor = 1.5 }

[[parameters]]
name = "a"
unit = ""
prior = { transform = "log", median = 0.3, factor = 1.3 }

[[parameters]]
name = "b"
unit = "1/h"
prior = { transform = "log", median = 0.02, factor = 1.5 }

[[parameters]]
name = "Y"
unit = ""
prior = { transform = "log", median = 0.5, factor = 1.3 }

[[records]]
name = "batch"
file = "batch.csv"
time = "time"
channels = [
  { column = "biomass", output = "biomass", noise = NOISE_X },
  { column = "substrate", output = "substrate", noise = NOISE_S },
  { column = "product", output = "product", noise = NOISE_P },
]
train = [0.0, TRAIN]

[explain]
hold_out_channels = ["HELD_OUT"]

"#;

const DEATH: &str = r#"
[[effects]]
name = "death"
says = "Cells die."
adds = [ { to = "X", term = "-kd*X" } ]
parameters = [ { name = "kd", unit = "1/h", range = [0, 1] } ]
"#;

/// The study, with the death of cells among the effects if asked for.
pub fn reactor(noise: [f64; 3], train: f64, held_out: &str, death: bool) -> String {
    let study = STUDY.replace("TRAIN", &train.to_string()).replace("HELD_OUT", held_out);
    let names = ["NOISE_X", "NOISE_S", "NOISE_P"];
    let study = names.iter().zip(noise).fold(study, |text, (name, sd)| text.replace(name, &sd.to_string()));
    if death { study + DEATH } else { study }
}

/// The reactor's recording with cells dying at this rate, and white noise of these sd.
pub fn recorded(noise: [f64; 3], span: f64, kd: f64) -> String {
    measured(span, kd, |k, clean| {
        clean.iter().zip(normals(clean.len(), 10 + k as u64)).map(|(y, e)| y + noise[k] * e).collect()
    })
}

/// The same with what the instruments of biomass (0), substrate and product show of the values.
pub fn measured(span: f64, kd: f64, shown: impl Fn(usize, &[f64]) -> Vec<f64>) -> String {
    let times = grid(120, span / 119.0);
    let flat = vec![1.0; times.len()];
    let text = reactor(NOISE, span, "product", true);
    let blank = csv("time,biomass,substrate,product", &[&times, &flat, &flat, &flat]);
    let values = [("mu", 0.4), ("Ks", 0.5), ("a", 0.3), ("b", 0.02), ("Y", 0.5)];
    let twin = Twin {
        values: values.map(|(name, v)| (name.to_owned(), v)).to_vec(),
        effects: vec![("death".to_owned(), kd)],
        seed: 1,
        ..Twin::default()
    };
    let made = simulate(&Case::new(&text, &[("batch.csv", blank)]).study(), &twin).unwrap();
    let column = |name: &str| &made.values[made.columns.iter().position(|c| c == name).unwrap()];
    let [x, s, p] = ["biomass", "substrate", "product"].map(column);
    csv("time,biomass,substrate,product", &[&times, &shown(0, x), &shown(1, s), &shown(2, p)])
}
