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
