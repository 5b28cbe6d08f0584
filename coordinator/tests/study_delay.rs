//! A delayed input, fitted in windows: each must hold the input's past.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::{Case, csv, grid, normals};

/// A first-order lag behind a delayed input, fitted window by window; `effect` says how the delay is written.
fn study(effect: &str) -> String {
    format!(
        r#"
[study]
name = "late"
[model]
kind = "equations"
inputs = [ {{ name = "u" }} ]
outputs = [ {{ name = "y", value = "x" }} ]
[[model.states]]
name = "x"
initial = 0.0
rate = "(u - x)/T"
[[effects]]
name = "late"
{effect}
[[parameters]]
name = "T"
prior = {{ transform = "log", median = 0.4, factor = 1.5 }}
[[parameters]]
name = "input_delay"
prior = {{ transform = "log", median = 0.3, factor = 1.5 }}
[[records]]
name = "one"
file = "late.csv"
inputs = {{ u = "u" }}
channels = [ {{ column = "y", output = "y", noise = 0.05 }} ]
[estimator]
kind = "roukf"
"#
    )
}

/// The input sin 2t from rest, and the answer to it with T = 0.5 and a delay of 0.25, with noise.
fn recording() -> String {
    let times = grid(81, 0.1);
    let u: Vec<f64> = times.iter().map(|t| (2.0 * t).sin()).collect();
    // T x' + x = sin ωt from rest has x = (sin ωt − ωT cos ωt + ωT exp(−t/T))/(1 + (ωT)²); here ωT = 1.
    let from_rest = |t: f64| 0.5 * ((2.0 * t).sin() - (2.0 * t).cos() + (-2.0 * t).exp());
    let answer = |t: f64| from_rest((t - 0.25).max(0.0));
    let y: Vec<f64> = times.iter().zip(normals(81, 4)).map(|(t, e)| answer(*t) + 0.05 * e).collect();
    csv("time,u,y", &[&times, &u, &y])
}

#[test]
fn a_built_in_delay_gives_the_posterior_of_its_term_written_out() {
    let written = "adds = [ { to = \"u\", term = \"delay(u, input_delay) - u\" } ]\n\
                   parameters = [ { name = \"input_delay\", unit = \"s\", range = [0, 30] } ]";
    let case = |effect: &str| Case::new(&study(effect), &[("late.csv", recording())]);
    let [built_in, written] = ["built_in = \"input-delay\"", written].map(case);
    assert_eq!(built_in.study().setup.effects[0].adds, written.study().setup.effects[0].adds);
    let [built_in, written] = [built_in.run(), written.run()];
    // A window without the input's past would read its first value instead, and hardly see the delay.
    assert_eq!(built_in.csv, written.csv);
    let delay = built_in.estimate("input_delay");
    // Four sd: one draw of the noise in sixteen thousand is further away. The prior's sd is 0.12.
    assert!(delay.sd < 0.02, "{}", delay.sd);
    assert!((delay.estimate - 0.25).abs() < 4.0 * delay.sd, "{} ± {}", delay.estimate, delay.sd);
}
