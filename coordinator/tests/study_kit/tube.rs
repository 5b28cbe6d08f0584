//! A small tube: a model with fields, its truth, and its recordings.

use starlings_coordinator::study::twin::{Recording, Twin, simulate};

use super::{Case, csv, grid};

/// A tube of six cells in two regions over two beats.
pub const TUBE: &str = r#"
[study]
name = "tube"
[model]
kind = "fsi-tube"
[model.layout]
cells = 6
regions = 2
[[parameters]]
name = "E1"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[parameters]]
name = "E2"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[records]]
name = "beats"
file = "wall.csv"
inputs = { flow = "flow" }
channels = [ { column = "displacement", output = "displacement", noise = 0.01 } ]
"#;

pub const BEAT: f64 = 0.8;
pub const TRUTH: [(&str, f64); 2] = [("E1", 3e6), ("E2", 7e6)];

/// A squared sine as long as the ejection, so that the input is smooth enough for coarse times.
pub fn flow(t: f64) -> f64 {
    let phase = (t / BEAT).fract();
    if phase < 0.4 { 300.0 * (std::f64::consts::PI * phase / 0.4).sin().powi(2) } else { 0.0 }
}

/// Times, flow and a column of zeros for every component: what a truth is simulated on.
pub fn blank(n: usize, step: f64, components: usize) -> String {
    let times = grid(n, step);
    let flow: Vec<f64> = times.iter().map(|t| flow(*t)).collect();
    let zeros = vec![0.0; n];
    let names: Vec<String> = (0..components).map(|i| format!("displacement[{i}]")).collect();
    let columns: Vec<&[f64]> = [times.as_slice(), flow.as_slice()]
        .into_iter()
        .chain(names.iter().map(|_| zeros.as_slice()))
        .collect();
    csv(&format!("time,flow,{}", names.join(",")), &columns)
}

/// The true tube, from its periodic state on.
pub fn truth(twin: Twin) -> Recording {
    let values = TRUTH.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let study = Case::new(TUBE, &[("wall.csv", blank(161, 0.01, 6))]).study();
    simulate(&study, &Twin { values, period: Some(BEAT), ..twin }).unwrap()
}

/// A recording as `starlings simulate` writes it, only with these columns.
pub fn columns(of: &Recording, keep: impl Fn(&str) -> bool) -> String {
    let kept: Vec<usize> = (0..of.columns.len()).filter(|i| keep(&of.columns[*i])).collect();
    let names: Vec<&str> = kept.iter().map(|i| of.columns[*i].as_str()).collect();
    let columns: Vec<&[f64]> =
        std::iter::once(of.times.as_slice()).chain(kept.iter().map(|i| of.values[*i].as_slice())).collect();
    csv(&format!("time,{}", names.join(",")), &columns)
}

pub fn start(of: &Recording) -> String {
    let rows: Vec<String> = of.start.iter().map(|(state, value)| format!("{state},{value:?}")).collect();
    format!("state,value\n{}\n", rows.join("\n"))
}

pub const STARTED: &str = "kind = \"fsi-tube\"\ninitial = \"start.csv\"";

pub fn started() -> String {
    TUBE.replace("kind = \"fsi-tube\"", STARTED)
}
