//! A tube whose wall was registered as surfaces: its study, its true motion, the files of profiles, and what is refused.
#![allow(dead_code)] // every test file uses its own part

use std::fmt::Write as _;

use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use starlings_coordinator::study::{Problem, Study};

use crate::study_kit::{Case, csv, grid, normals};

/// A tube of five cells of 5 cm in one region.
pub(crate) const STUDY: &str = r#"
[study]
name = "wall"
[model]
kind = "fsi-tube"
[model.layout]
cells = 5
regions = 1
[[parameters]]
name = "E1"
prior = { transform = "log2", median = 5e6, sd = 1.0 }
[[records]]
name = "beats"
file = "flow.csv"
inputs = { flow = "flow" }
channels = [ { CHANNEL } ]
"#;
pub(crate) const SURFACE: &str =
    r#"surface = "profiles.csv", rest = "rest.csv", output = "displacement", noise = 0.01"#;
pub(crate) const COLUMN: &str = r#"column = "displacement", output = "displacement", noise = 0.01"#;
pub(crate) const TRUTH: f64 = 3.5e6;
pub(crate) const SD: f64 = 0.01;
pub(crate) const NODES: [f64; 5] = [2.5, 7.5, 12.5, 17.5, 22.5];

pub(crate) fn study(channel: &str) -> String {
    STUDY.replace("CHANNEL", channel)
}

/// The record's file: times and flow, and a column that is not used.
pub(crate) fn flow() -> String {
    let times = grid(41, 0.02);
    let values: Vec<f64> =
        times.iter().map(|t| if *t < 0.4 { 300.0 * (7.854 * t).sin().powi(2) } else { 0.0 }).collect();
    csv("time,flow,zero", &[&times, &values, &[0.0; 41]])
}

/// The true tube at the times of the record.
pub(crate) fn truth() -> Recording {
    let blank = study(r#"column = "zero", output = "pressure", noise = 1.0"#);
    let study = Case::new(&blank, &[("flow.csv", flow())]).study();
    simulate(&study, &Twin { values: vec![("E1".to_owned(), TRUTH)], ..Twin::default() }).unwrap()
}

/// Displacement of each node at every time, with noise.
pub(crate) fn displacements(noise: f64) -> (Vec<f64>, Vec<Vec<f64>>) {
    let of = truth();
    let column = |i: usize| {
        let at = of.columns.iter().position(|c| *c == format!("displacement[{i}]")).unwrap();
        let errors = normals(of.times.len(), i as u64);
        of.values[at].iter().zip(errors).map(|(v, e)| v + noise * e).collect()
    };
    (of.times.clone(), (0..5).map(column).collect())
}

/// Profiles over the nodes and one point further at either end, shifted along the axis.
pub(crate) fn profiles(noise: f64, slide: f64) -> String {
    let (times, columns) = displacements(noise);
    let mut text = "time,z,r\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        writeln!(text, "{t},{},{:?}", -1.0 + slide, 1.0 + columns[0][k]).unwrap();
        for (z, column) in NODES.iter().zip(&columns) {
            writeln!(text, "{t},{},{:?}", z + slide, 1.0 + column[k]).unwrap();
        }
        writeln!(text, "{t},{},{:?}", 26.0 + slide, 1.0 + columns[4][k]).unwrap();
    }
    text
}

pub(crate) fn rest() -> String {
    csv("z,r", &[&NODES, &[1.0; 5]])
}

/// The only problem of a study with these files: `file:line: message; help`, without the folder.
pub(crate) fn problem(study: &str, files: &[(&str, String)]) -> String {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    let found: Vec<Problem> = Study::load(&file).err().map_or_else(Vec::new, |error| error.problems);
    assert_eq!(found.len(), 1, "{found:?}");
    let p = &found[0];
    let folder = format!("{}/", p.file.parent().unwrap().display());
    let name = p.file.file_name().unwrap().to_string_lossy().into_owned();
    let line = p.line_column().unwrap_or_default().0;
    format!("{name}:{line}: {}; {}", p.message.replace(&folder, ""), p.help.clone().unwrap_or_default())
}
