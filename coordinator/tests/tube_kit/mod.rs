//! Twins of the elastic tube: a known truth over some beats, its recordings, and studies of them.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

use std::f64::consts::PI;
use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};
use starlings_models::Model;
use starlings_models::limits::Limits;
use starlings_models::native::FsiTube;
use starlings_models::native::fsi_tube::Layout;
use starlings_models::native::fsi_tube::layout::Regions;
use starlings_models::segment::{History, Segment};

use crate::study_kit::{Case, Done, csv, grid, normals};

pub const MM_HG: f64 = 1333.22;
/// Stiffness of the five regions in octaves above 5e6 dyn/cm².
pub const OCTAVES: [f64; 5] = [0.5, 1.5, -0.5, 0.0, -1.0];
/// Steps of one beat.
const BEAT: usize = 800;
/// Length of a step in s, and steps between two observations.
const STEP: f64 = 1e-3;
pub const EVERY: usize = 10;

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

/// A half sine of 0.3 s in every beat of 0.8 s, in cm³/s, at step `i`.
fn inflow(i: usize) -> f64 {
    let phase = (i % BEAT) as f64 * STEP;
    if phase < 0.3 { 300.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

/// A simulated tube.
pub struct Truth {
    pub cells: usize,
    pub octaves: Vec<f64>,
    /// Periodic state at time zero.
    pub start: Vec<f64>,
    /// Displacements at every observation time, one row per time.
    pub displacement: Vec<Vec<f64>>,
    /// A tenth of the largest pulsatile amplitude of a cell.
    pub noise: f64,
    pub beats: usize,
}

impl Truth {
    /// Ten beats of the five regions: all tests with them may share their noise.
    pub fn five(beats: usize) -> Self {
        Self::new(25, &OCTAVES, &[], beats)
    }

    /// Beats from the periodic state, with other parameters by name.
    pub fn new(cells: usize, octaves: &[f64], others: &[(&str, f64)], beats: usize) -> Self {
        let layout = Layout { cells, regions: Regions::Equal(octaves.len()), ..Layout::default() };
        let model = FsiTube::new(&layout, 25.0).unwrap();
        let theta = theta(&model, octaves, others);
        let start = periodic(&model, &theta);
        let mut x = start.clone();
        let mut displacement = vec![x[..cells].to_vec()];
        let (mut low, mut high) = (x[..cells].to_vec(), x[..cells].to_vec());
        for i in 0..beats * BEAT {
            step(&model, &theta, [inflow(i), inflow(i + 1)], &mut x);
            for (cell, eta) in x[..cells].iter().enumerate() {
                low[cell] = low[cell].min(*eta);
                high[cell] = high[cell].max(*eta);
            }
            if (i + 1) % EVERY == 0 {
                displacement.push(x[..cells].to_vec());
            }
        }
        let noise = 0.1 * low.iter().zip(&high).map(|(low, high)| high - low).fold(0.0, f64::max);
        Self { cells, octaves: octaves.to_vec(), start, displacement, noise, beats }
    }

    /// `wall.csv` with this share of [`Truth::noise`], `flow.csv`, and `initial.csv` with the true start.
    pub fn files(&self, share: f64, seed: u64) -> [(&'static str, String); 3] {
        let n = self.displacement.len();
        let times = grid(n, STEP * EVERY as f64);
        let noise = normals(n * self.cells, seed);
        let column = |cell: usize| -> Vec<f64> {
            let noisy =
                |(i, row): (usize, &Vec<f64>)| row[cell] + share * self.noise * noise[i * self.cells + cell];
            self.displacement.iter().enumerate().map(noisy).collect()
        };
        let columns: Vec<Vec<f64>> = std::iter::once(times).chain((0..self.cells).map(column)).collect();
        let names: Vec<String> = (0..self.cells).map(|cell| format!("eta[{cell}]")).collect();
        let refs: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let steps = self.beats * BEAT;
        let flow: Vec<f64> = (0..=steps).map(inflow).collect();
        [
            ("wall.csv", csv(&format!("time,{}", names.join(",")), &refs)),
            ("flow.csv", csv("time,flow", &[&grid(steps + 1, STEP), &flow])),
            ("initial.csv", self.initial()),
        ]
    }

    fn initial(&self) -> String {
        let mut text = "state,value\n".to_owned();
        for (i, value) in self.start.iter().enumerate() {
            let (at, n) = (i % self.cells, self.cells);
            let state = ["eta", "w", "pi"][i / n];
            let index = if i < 2 * n { format!("[{at}]") } else { String::new() };
            writeln!(text, "{state}{index},{value:?}").unwrap();
        }
        text
    }

    /// The study of these recordings.
    pub fn study(&self, asked: &Asked) -> String {
        let n = self.octaves.len();
        let young = |i: usize| {
            format!(
                "[[parameters]]\nname = \"E{}\"\nprior = {{ transform = \"log2\", median = 5e6, sd = 1.0 }}\n{}\n",
                i + 1,
                asked.process
            )
        };
        let young: String = if asked.young { (0..n).map(young).collect() } else { String::new() };
        format!(
            r#"
[study]
name = "tube"
[model]
kind = "fsi-tube"
{}
[model.constants]
{}
[model.layout]
cells = {}
regions = {n}
start = "{}"
{young}
{}
{}
[[records]]
name = "wall"
file = "wall.csv"
inputs = {{ flow = "flow.csv:flow" }}
channels = [ {{ column = "eta", output = "displacement", noise = {:?} }} ]
[estimator]
{}
"#,
            if asked.right_start { "initial = \"initial.csv\"" } else { "" },
            asked.constants,
            self.cells,
            if asked.right_start { "equilibrium" } else { "reference" },
            asked.parameters,
            asked.observer,
            self.noise,
            asked.estimator,
        )
    }

    /// Runs a study of recordings with this share of the noise.
    pub fn run(&self, asked: &Asked, share: f64, seed: u64) -> Done {
        Case::new(&self.study(asked), &self.files(share, seed)).run()
    }
}

/// What differs between studies of one truth.
pub struct Asked {
    /// Young's moduli of all regions, median 5e6 and an octave of sd.
    pub young: bool,
    pub process: &'static str,
    /// More `[[parameters]]`.
    pub parameters: String,
    pub constants: String,
    /// The true state at time zero; otherwise rest, displaced by the reference stiffness.
    pub right_start: bool,
    pub observer: &'static str,
    pub estimator: &'static str,
}

impl Default for Asked {
    fn default() -> Self {
        Self {
            young: true,
            process: "",
            parameters: String::new(),
            constants: String::new(),
            right_start: true,
            observer: "",
            estimator: "passes = 2",
        }
    }
}

impl Asked {
    /// The initial pressure 60 ± 30 mmHg as a parameter.
    pub fn uncertain_start(estimator: &'static str) -> Self {
        let (median, sd) = (60.0 * MM_HG, 30.0 * MM_HG);
        let prior = format!("{{ transform = \"linear\", median = {median:?}, sd = {sd:?} }}");
        Self {
            parameters: format!("[[parameters]]\nname = \"p0\"\nprior = {prior}\n"),
            right_start: false,
            estimator,
            ..Self::default()
        }
    }
}

/// Mean and standard deviation of parameters in transformed units after a step of the last pass, in the order of the study.
pub fn after(done: &Done, step: usize) -> Vec<(f64, f64)> {
    let rows = done.table("estimates", "pass, step, parameter, mean, sd");
    let last: usize = rows.iter().map(|row| row[0].parse().unwrap()).max().unwrap();
    let find = |name: &str| {
        let same =
            |row: &&Vec<String>| row[0].parse() == Ok(last) && row[1].parse() == Ok(step) && row[2] == name;
        let row = rows.iter().find(same).unwrap_or_else(|| panic!("no estimate of {name} at step {step}"));
        (row[3].parse().unwrap(), row[4].parse().unwrap())
    };
    done.summary.parameters.iter().map(|p| find(&p.name)).collect()
}

/// Octaves above 5e6 of the first estimates, and their sd.
pub fn octaves(done: &Done, n: usize, step: usize) -> Vec<(f64, f64)> {
    let all = after(done, step);
    all.into_iter().take(n).map(|(mean, sd)| (mean - 5e6_f64.log2(), sd)).collect()
}

/// Root mean square distance from the truth.
pub fn rms(found: &[(f64, f64)], truth: &[f64]) -> f64 {
    let square = |((mean, _), truth): (&(f64, f64), &f64)| (mean - truth).powi(2);
    (found.iter().zip(truth).map(square).sum::<f64>() / truth.len() as f64).sqrt()
}

fn theta(model: &FsiTube, octaves: &[f64], others: &[(&str, f64)]) -> Vec<f64> {
    let list = &model.spec().parameters;
    let mut theta: Vec<f64> = list.iter().map(|q| q.default.unwrap()).collect();
    for (value, octave) in theta.iter_mut().zip(octaves) {
        *value = 5e6 * octave.exp2();
    }
    for (name, value) in others {
        theta[list.iter().position(|q| q.name == *name).unwrap()] = *value;
    }
    theta
}

fn step(model: &FsiTube, theta: &[f64], q: [f64; 2], x: &mut [f64]) {
    let slope = [(q[1] - q[0]) / STEP];
    let segment = Segment {
        t0: 0.0,
        t1: STEP,
        u0: &q[..1],
        slope: &slope,
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    model.advance(segment, theta, x).unwrap();
}

/// The one state to which a beat leads back.
fn periodic(model: &FsiTube, theta: &[f64]) -> Vec<f64> {
    let n = model.spec().n_state();
    let mut beat = DMatrix::<f64>::identity(n, n);
    for mut column in beat.column_iter_mut() {
        for _ in 0..BEAT {
            step(model, theta, [0.0; 2], column.as_mut_slice());
        }
    }
    let mut forced = vec![0.0; n];
    for i in 0..BEAT {
        step(model, theta, [inflow(i), inflow(i + 1)], &mut forced);
    }
    let left = DMatrix::identity(n, n) - beat;
    left.lu().solve(&DVector::from_vec(forced)).unwrap().as_slice().to_vec()
}
