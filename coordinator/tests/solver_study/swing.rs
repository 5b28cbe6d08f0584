//! A mass on a spring under a known force, of which position and velocity are seen.

use starlings_coordinator::study::twin::{Twin, simulate};

use crate::inside::{Place, no_host};
use crate::study_kit::{csv, grid};

const EQUATIONS: &str = r#"
kind = "equations"
constants = { m = 1.0 }
outputs = [
    { name = "position", unit = "m", role = "displacement", value = "x" },
    { name = "velocity", unit = "m/s", role = "velocity", value = "v" },
]
inputs = [ { name = "force", unit = "N", role = "force" } ]
roles = { k = "stiffness", c = "damping", m = "inertia" }
solver = { method = "dopri5", rtol = 1e-10, atol = 1e-12 }

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
"#;

const REST: &str = r#"
[[parameters]]
name = "k"
prior = { transform = "log", median = 4.0, factor = 1.3 }

[[parameters]]
name = "c"
prior = { transform = "log", median = 0.25, factor = 1.5 }

[[parameters]]
name = "initial:x"
prior = { transform = "linear", median = 0.5, sd = 0.2 }

[[records]]
name = "shaken"
file = "swing.csv"
inputs = { force = "force" }
channels = [
    { column = "position", output = "position", noise = 0.02 },
    { column = "velocity", output = "velocity", noise = 0.04 },
]
train = [0.0, 15.0]
"#;

/// Keys of `[model]` of the solver.
pub(crate) const SOLVER: &str = "kind = \"solver\"\ncommand = [\"swing\"]\nconstants = { m = 1.0 }\n";

fn study(model: &str, more: &str) -> String {
    format!("[study]\nname = \"swing\"\nseed = 5\n\n[model]\n{model}\n{REST}\n{more}")
}

/// The study with its equations.
pub(crate) fn native(more: &str) -> String {
    study(EQUATIONS, more)
}

/// The study with a solver that runs them.
pub(crate) fn solver(more: &str) -> String {
    study(SOLVER, more)
}

/// A force of three tones.
fn force(t: f64) -> f64 {
    1.1 * (1.3 * t).sin() + 0.9 * (2.17 * t + 1.0).sin() + 0.7 * (0.41 * t + 0.5).sin()
}

/// A recording of the swing with these effects in it and the stated noise.
pub(crate) fn recording(effects: &[(&str, f64)], values: &[(&str, f64)], seed: u64) -> String {
    let times = grid(241, 0.1);
    let pushed: Vec<f64> = times.iter().map(|t| force(*t)).collect();
    let blank = vec![0.0; times.len()];
    let empty = csv("time,position,velocity,force", &[&times, &blank, &blank, &pushed]);
    let place = Place::new(&[("study.toml", &native("")), ("swing.csv", &empty)]);
    let named =
        |list: &[(&str, f64)]| list.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect::<Vec<_>>();
    let truth = [&[("k", 4.4), ("c", 0.3), ("initial:x", 0.55)], values].concat();
    let twin = Twin { values: named(&truth), effects: named(effects), seed, ..Twin::default() };
    let made = simulate(&place.load(&no_host()).unwrap(), &twin).unwrap();
    let noisy = |column: usize, sd: f64| -> Vec<f64> {
        let noise = crate::study_kit::normals(times.len(), seed + column as u64);
        made.values[column].iter().zip(noise).map(|(v, e)| v + sd * e).collect()
    };
    csv("time,position,velocity,force", &[&times, &noisy(0, 0.02), &noisy(1, 0.04), &pushed])
}
