//! Refits of an effect whose absence has bent the parameters of the model.
#![allow(clippy::unwrap_used, dead_code)] // a failed unwrap is a failed test; the kit serves others too
mod explain_kit;
mod study_kit;

use explain_kit::{go, sets};
use starlings_coordinator::explain::Options;
use starlings_coordinator::fleet::InProcess;
use study_kit::{Case, csv, grid, normals};

/// Soil that rain wets and that dries evenly.
const SOIL: &str = r#"
[study]
name = "soil"
time_unit = "d"

[model]
kind = "equations"
outputs = [{ name = "theta", unit = "1", role = "level", value = "w" }]
inputs = [{ name = "rain", unit = "mm/d" }]

[[model.states]]
name = "w"
unit = "1"
role = "level"
initial = "w0"
rate = "rain/D - e*w"

[[parameters]]
name = "D"
unit = "mm"
prior = { transform = "log", median = 300, factor = 1.2 }

[[parameters]]
name = "e"
unit = "1/d"
prior = { transform = "log", median = 0.015, factor = 1.6 }

[[parameters]]
name = "w0"
unit = "1"
prior = { transform = "linear", median = 0.22, sd = 0.02 }

[[records]]
name = "year"
file = "year.csv"
channels = [{ column = "theta", output = "theta", noise = 0.006 }]
inputs = { rain = "rain" }
train = [0, 240]

[explain]
library = "all"
"#;

/// A year in which soil above 0.31 runs dry faster, in steps of a sixteenth of a day; rain falls on three days of ten.
fn year(seed: u64) -> String {
    let n = 365;
    let (falls, noise) = (normals(2 * n, seed), normals(n, seed + 1));
    let rain: Vec<f64> =
        falls.chunks_exact(2).map(|z| if z[0] < -0.52 { 8.0 * z[1].powi(2) } else { 0.0 }).collect();
    let (mut w, mut theta) = (0.22_f64, Vec::with_capacity(n));
    for day in 0..n {
        theta.push(w + 0.006 * noise[day]);
        for k in 0..16 {
            let part = (f64::from(k) + 0.5) / 16.0;
            let falling = rain[day] + part * (rain[(day + 1).min(n - 1)] - rain[day]);
            let rate = |w: f64| falling / 300.0 - 0.012 * w - 0.25 * (w - 0.31).max(0.0);
            w += rate(w + rate(w) / 32.0) / 16.0;
        }
    }
    csv("time,rain,theta", &[&grid(n, 1.0), &rain, &theta])
}

#[test]
fn a_threshold_is_found_where_the_fit_without_it_has_bent_all_parameters() {
    // The soil looks deeper and drains faster than it is, until the water above the threshold has a way of its own: secants from there
    // know nothing of the threshold's place, and are soon trusted no further.
    for seed in [2, 9, 12] {
        let case = Case::new(SOIL, &[("year.csv", year(seed))]);
        let found = go(&case, &case.fresh(), &mut InProcess::new(2), &Options::default());
        let found = found.unwrap_or_else(|error| panic!("{error}")).explanation;
        assert_eq!(sets(&found), vec![vec!["overflow".to_owned()]], "{seed}: {}", found.headline);
        assert!(found.gap.iter().all(|row| row.after < 1.2 * row.noise), "{seed}: {:?}", found.gap);
    }
}

/// A rocket motor of steady burning area, integrated in steps of a fifth of its sampling interval.
const MOTOR: &str = r#"
[study]
name = "motor"

[model]
kind = "equations"
constants = { At = 1.0 }
roles = { At = "throat-area", a = "burn-rate" }
outputs = [
  { name = "pressure", role = "pressure", value = "p" },
  { name = "thrust", role = "thrust", value = "Cf*At*p" },
]
solver = { method = "fixed", step = 0.004 }

[[model.states]]
name = "p"
role = "pressure"
initial = 0.3
rate = { gas = "25*a*max(p, 0)^n", nozzle = "-25*At*p" }

[[parameters]]
name = "a"
prior = { transform = "log", median = 1.0, factor = 1.12 }

[[parameters]]
name = "n"
prior = { transform = "linear", median = 0.35, sd = 0.04 }

[[parameters]]
name = "Cf"
prior = { transform = "log", median = 1.5, factor = 1.08 }

[[records]]
name = "firing"
file = "firing.csv"
channels = [
  { column = "p", output = "pressure", noise = 0.005 },
  { column = "F", output = "thrust", noise = 0.007 },
]
train = [0, 3]

[explain]
library = "all"
"#;

/// Four seconds in which the throat widens by 3 % at an instant.
fn firing(at: f64, seed: u64) -> String {
    let n = 200;
    let noise = normals(2 * n, seed);
    let area = |t: f64| if t < at { 1.0 } else { 1.03 };
    let (mut p, mut rows) = (0.3_f64, [Vec::new(), Vec::new()]);
    for k in 0..n {
        let t = 0.02 * k as f64;
        rows[0].push(p + 0.005 * noise[2 * k]);
        rows[1].push(1.45 * area(t) * p + 0.007 * noise[2 * k + 1]);
        for i in 0..40 {
            let rate = |p: f64| 25.0 * (0.98 * p.powf(0.34) - area(t + 0.000_5 * (f64::from(i) + 0.5)) * p);
            p += 0.000_5 * rate(p + 0.000_25 * rate(p));
        }
    }
    csv("time,p,F", &[&grid(n, 0.02), &rows[0], &rows[1]])
}

#[test]
fn an_instant_is_found_where_no_difference_within_a_step_of_the_integration_shows_it() {
    // Within a step of 0.004 the place of the instant changes nothing, and a thousandth of its prior is less than that.
    for (at, seed) in [(1.297, 1), (1.711, 2), (2.345, 3)] {
        let case = Case::new(MOTOR, &[("firing.csv", firing(at, seed))]);
        let found = go(&case, &case.fresh(), &mut InProcess::new(2), &Options::default());
        let found = found.unwrap_or_else(|error| panic!("{error}")).explanation;
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
        assert_eq!(named, ["throat-step"], "{seed}: {}", found.headline);
        let when = &found.effects[0].parameters[1];
        assert!((when.estimate - at).abs() < 0.01 && when.sd < 0.01, "{seed}: {when:?}");
    }
}

/// Cells that grow to what their medium holds, from a thin and from a dense beginning.
const CULTURE: &str = r#"
[study]
name = "culture"
time_unit = "h"

[model]
kind = "equations"
outputs = [{ name = "density", value = "X" }]

[[model.states]]
name = "X"
initial = "X0"
rate = "mu*X*(1 - X/K)"

[[parameters]]
name = "mu"
unit = "1/h"
prior = { transform = "log", median = 0.6, factor = 1.3 }

[[parameters]]
name = "K"
prior = { transform = "log", median = 1.2, factor = 1.2 }

[[parameters]]
name = "X0"
per_record = true
prior = { transform = "linear", median = 0.05, sd = 0.02 }

[[records]]
name = "thin"
file = "thin.csv"
channels = [{ column = "X", output = "density", noise = 0.008 }]

[[records]]
name = "dense"
file = "dense.csv"
channels = [{ column = "X", output = "density", noise = 0.008 }]
train = [0, 11]

[[effects]]
name = "lag"
says = "The cells adapt before they grow (Baranyi and Roberts 1994)."
adds = [{ to = "X", term = "-mu*X*(1 - X/K)*hl*exp(-nu*t)/(1 + hl*exp(-nu*t))" }]
parameters = [{ name = "hl", range = [0, inf] }, { name = "nu", unit = "1/h", range = [0.05, 10], grid = [0.3, 0.6, 1.2] }]

[explain]
library = "all"
"#;

/// Twenty hours of growth after a lag.
fn culture(start: f64, seed: u64) -> String {
    let (n, noise, mut x) = (80, normals(80, seed), start);
    let mut rows = Vec::with_capacity(n);
    for (k, noise) in noise.iter().enumerate() {
        rows.push(x + 0.008 * noise);
        for i in 0..20 {
            let late = 15.0 * (-0.62 * (0.25 * k as f64 + 0.0125 * (f64::from(i) + 0.5))).exp();
            let rate = |x: f64| 0.62 * x * (1.0 - x / 1.2) / (1.0 + late);
            x += 0.0125 * rate(x + 0.00625 * rate(x));
        }
    }
    csv("time,X", &[&grid(n, 0.25), &rows])
}

#[test]
fn what_takes_nearly_all_of_a_gap_away_is_refitted_though_the_parameters_imitate_most_of_it() {
    // A lag looks like fewer cells that grow more slowly, but for a fortieth of it; the gap is so long a wave that it holds few independent
    // values, by whose noise nothing would be significant.
    for seed in 1..4 {
        let files = [("thin.csv", culture(0.03, seed)), ("dense.csv", culture(0.09, seed + 10))];
        let case = Case::new(CULTURE, &files);
        let found = go(&case, &case.fresh(), &mut InProcess::new(2), &Options::default());
        let found = found.unwrap_or_else(|error| panic!("{error}")).explanation;
        let named: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
        assert_eq!(named, ["lag"], "{seed}: {}", found.headline);
    }
}
