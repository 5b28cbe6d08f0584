//! A system with its experiment: the study around a data file, and the finer simulation that plays reality.
//!
//! Next file to read: [`crate::draw`], which puts an effect into it.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use starlings_coordinator::study::Study;
use starlings_models::effect::{library, scale::resolve};
use starlings_models::equations::{Method, SolverDef};
use starlings_models::{BuildSetup, EffectDef, Forward, Job, Setup, Window};

use crate::systems::{Finer, System};

/// Share of the record that trains.
pub const TRAINS: f64 = 0.55;

/// How the noise is told to the study.
#[derive(Clone, Copy)]
pub enum Told<'a> {
    /// The standard deviation of each channel.
    Sd(&'a [f64]),
    /// Not at all: it is found from the data.
    Auto,
}

/// A system with its experiment.
pub struct World<'a> {
    pub system: &'a System,
    pub times: Vec<f64>,
    /// The study around data that mean nothing yet; its candidates include the aliens.
    pub study: Study,
    /// The model, and the truth without its effect; outputs are the channels.
    pub model: Setup,
    pub truth: Setup,
    /// Every effect that can be put into the truth: the library's, the study's, the aliens.
    pub effects: Vec<EffectDef>,
    window: Arc<Window>,
}

impl<'a> World<'a> {
    /// The experiment with `n` samples.
    pub fn new(system: &'a System, n: usize) -> Self {
        let times: Vec<f64> = (0..n).map(|i| system.span * i as f64 / (n - 1) as f64).collect();
        let folder = tempfile::tempdir().unwrap();
        let silence: Vec<Vec<f64>> = system.channels.iter().map(|_| vec![0.0; n]).collect();
        let noise = vec![1.0; system.channels.len()];
        let text = study_text(system, Told::Sd(&noise), 1) + system.aliens + system.unlisted;
        let study = write(system, folder.path(), &text, &times, &silence);
        let model = study.setup.clone();
        let truth = finer(system, &model);
        let spec = model.spec().unwrap_or_else(|error| panic!("{}: {error}", system.name));
        let inputs = study.records[0].inputs.clone();
        let observed = vec![f64::NAN; n * system.channels.len()];
        let window =
            Arc::new(Window { start: times[0], times: times.clone(), observed, inputs, since: vec![] });
        let mut world = World { system, times, study, model, truth, effects: Vec::new(), window };
        world.effects = library(&spec);
        world.effects.extend(world.study.candidates.iter().cloned());
        world
    }

    /// The effect of this name.
    pub fn effect(&self, name: &str) -> &EffectDef {
        self.effects.iter().find(|effect| effect.name == name).unwrap_or_else(|| {
            let names: Vec<&str> = self.effects.iter().map(|effect| effect.name.as_str()).collect();
            panic!("{} has no effect `{name}`; it has {names:?}", self.system.name)
        })
    }

    /// The effect of this name with its scales resolved against a run of the truth without it.
    pub fn resolved(&self, name: &str, theta: &[f64]) -> EffectDef {
        let record = [self.times[0], self.system.span];
        let sampling = self.times[1] - self.times[0];
        let mut probe = self.truth.clone();
        let spec = probe.spec().unwrap();
        let scalars = spec.outputs.iter().chain(&spec.states).filter(|q| q.size == 1);
        probe.outputs = scalars.map(|q| q.name.clone()).collect();
        probe.outputs.dedup();
        let forward = probe.build().unwrap_or_else(|error| panic!("{}: {error}", self.system.name));
        let courses = self.run_of(forward.as_ref(), probe.outputs.len(), theta).unwrap_or_default();
        let course = |name: &str| {
            let input =
                spec.inputs.iter().position(|q| q.name == name).map(|i| &self.window.inputs[i].values);
            let output = probe.outputs.iter().position(|output| output == name).and_then(|i| courses.get(i));
            output.or(input).map(|values| {
                let ends = (f64::INFINITY, f64::NEG_INFINITY);
                let (lo, hi) = values.iter().fold(ends, |(lo, hi), v| (v.min(lo), v.max(hi)));
                [lo, hi]
            })
        };
        resolve(self.effect(name), &course, record, sampling)
    }

    /// Number of samples that train.
    pub fn n_train(&self) -> usize {
        let end = TRAINS * self.system.span;
        self.times.iter().filter(|t| **t <= end).count()
    }

    /// The outputs of a run, one column per channel.
    pub fn run(&self, forward: &dyn Forward, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        self.run_of(forward, self.system.channels.len(), theta)
    }

    fn run_of(&self, forward: &dyn Forward, n: usize, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        let mut window = Arc::clone(&self.window);
        if window.observed.len() != n * window.times.len() {
            Arc::make_mut(&mut window).observed = vec![f64::NAN; n * self.times.len()];
        }
        let job = Job { particle: 0, record: 0, window, theta: theta.to_vec(), state: None };
        let outputs = forward.run(&job).ok()?.outputs;
        let column = |c: usize| outputs.iter().skip(c).step_by(n).copied().collect();
        Some((0..n).map(column).collect())
    }

    /// Writes these data and the study around them into a folder, and reads both back.
    pub fn study_of(&self, folder: &Path, data: &[Vec<f64>], told: Told<'_>, seed: u64) -> Study {
        write(self.system, folder, &study_text(self.system, told, seed), &self.times, data)
    }
}

/// The setup of the truth.
fn finer(system: &System, model: &Setup) -> Setup {
    let mut truth = model.clone();
    match &system.finer {
        Finer::Tolerance => {}
        Finer::Twin(text) => {
            let folder = tempfile::tempdir().unwrap();
            let inputs: Vec<String> = system.inputs.iter().map(|(name, _)| (*name).to_owned()).collect();
            let parameters = system.text.split_once("[[parameters]]").map_or("", |(_, rest)| rest);
            let noise = vec![1.0; system.channels.len()];
            let text = format!(
                "{}{text}\n[[parameters]]{parameters}\n{}",
                head(system, 1),
                tail(system, Told::Sd(&noise))
            );
            let columns = vec![vec![0.0; 4]; inputs.len() + system.channels.len()];
            let study = write_columns(folder.path(), &text, &inputs, system, &[0.0, 1.0, 2.0, 3.0], &columns);
            truth.model = study.setup.model;
        }
        Finer::LayoutStep(step) => {
            let layout = truth.model.layout.as_mut().expect("a model with a layout");
            layout["step"] = serde_json::json!(step);
        }
    }
    if let Some(equations) = &mut truth.model.equations {
        equations.solver = SolverDef { method: Method::Auto, rtol: 1e-11, atol: 1e-12, step: None };
    }
    truth
}

fn head(system: &System, seed: u64) -> String {
    format!("[study]\nname = \"{}\"\nseed = {seed}\n", system.name)
}

fn tail(system: &System, told: Told<'_>) -> String {
    let mut text = String::from("\n[[records]]\nname = \"run\"\nfile = \"data.csv\"\n");
    let inputs: Vec<String> = system.inputs.iter().map(|(name, _)| format!("{name} = \"{name}\"")).collect();
    writeln!(text, "inputs = {{ {} }}\nchannels = [", inputs.join(", ")).unwrap();
    for (i, channel) in system.channels.iter().enumerate() {
        let noise = match told {
            Told::Sd(sd) => format!("{:?}", sd[i]),
            Told::Auto => "\"auto\"".to_owned(),
        };
        writeln!(text, "  {{ column = \"y{i}\", output = \"{channel}\", noise = {noise} }},").unwrap();
    }
    write!(text, "]\ntrain = [0.0, {:?}]\n\n[estimator]\nkind = \"batch\"\n", TRAINS * system.span).unwrap();
    text
}

/// The study's text; more `[[effects]]` can follow it.
fn study_text(system: &System, told: Told<'_>, seed: u64) -> String {
    head(system, seed) + system.text + &tail(system, told)
}

fn write(system: &System, folder: &Path, text: &str, times: &[f64], data: &[Vec<f64>]) -> Study {
    let inputs: Vec<String> = system.inputs.iter().map(|(name, _)| (*name).to_owned()).collect();
    let mut columns: Vec<Vec<f64>> =
        system.inputs.iter().map(|(_, course)| times.iter().map(|t| course(*t)).collect()).collect();
    columns.extend(data.iter().cloned());
    write_columns(folder, text, &inputs, system, times, &columns)
}

fn write_columns(
    folder: &Path,
    text: &str,
    inputs: &[String],
    system: &System,
    times: &[f64],
    columns: &[Vec<f64>],
) -> Study {
    let mut csv = String::from("time");
    let channels = (0..system.channels.len()).map(|i| format!("y{i}"));
    for name in inputs.iter().cloned().chain(channels) {
        write!(csv, ",{name}").unwrap();
    }
    for (i, time) in times.iter().enumerate() {
        write!(csv, "\n{time:?}").unwrap();
        for column in columns {
            write!(csv, ",{:?}", column[i]).unwrap();
        }
    }
    csv.push('\n');
    let file = folder.join("study.toml");
    std::fs::write(folder.join("data.csv"), csv).unwrap();
    std::fs::write(&file, text).unwrap();
    Study::load(&file).unwrap_or_else(|error| panic!("{}: {error}\n{text}", system.name))
}
