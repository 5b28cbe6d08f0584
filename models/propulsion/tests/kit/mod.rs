//! Runs of motors in the tests of this crate.
#![allow(
    clippy::unwrap_used,
    dead_code,
    unreachable_pub,
    reason = "test helpers; each test binary uses its part"
)]

use std::sync::Arc;

use serde_json::Value;
use starlings_models_core::{Forward, Job, Model, ModelDef, NativeModels, Setup, Signal, Simulator, Window};
use starlings_propulsion::MODELS;

/// The model of this kind in a layout.
pub fn model(kind: &str, layout: &Value) -> Box<dyn Model> {
    let def = ModelDef { kind: kind.to_owned(), layout: Some(layout.clone()), ..ModelDef::default() };
    (NativeModels::of(&[MODELS]).find(kind).unwrap().build)(&def).unwrap()
}

/// A motor with some of its constants and the outputs that are wanted.
pub struct Motor {
    pub kind: &'static str,
    pub layout: Value,
    pub constants: Vec<(&'static str, f64)>,
    pub outputs: Vec<&'static str>,
}

impl Motor {
    fn setup(&self, seed: Option<u64>) -> Setup {
        let mut setup = Setup { noise: seed, max_steps: Some(50_000_000), ..Setup::default() };
        self.kind.clone_into(&mut setup.model.kind);
        setup.model.layout = Some(self.layout.clone());
        setup.model.constants =
            self.constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        setup.outputs = self.outputs.iter().map(|name| (*name).to_owned()).collect();
        setup
    }

    /// Rows of outputs at these times, from the start or from a state.
    pub fn run_from(
        &self,
        state: Option<Vec<f64>>,
        times: &[f64],
        seed: Option<u64>,
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let setup = self.setup(seed);
        let simulator =
            Simulator::new(model(self.kind, &self.layout), &setup, NativeModels::of(&[MODELS])).unwrap();
        let n_input = simulator.spec().inputs.len();
        let n_obs = rows(&*model(self.kind, &self.layout), &self.outputs);
        let window = Window::free(
            0.0,
            times.to_vec(),
            n_obs,
            vec![Signal { times: vec![0.0, 1.0], values: vec![1.0, 0.8] }; n_input],
        );
        let job = Job {
            particle: 0,
            record: 0,
            window: Arc::new(window),
            theta: vec![],
            state: state.map(Into::into),
        };
        let ran = simulator.run(&job).unwrap();
        (ran.outputs.chunks(n_obs).map(<[f64]>::to_vec).collect(), ran.state.into_vec())
    }

    /// The state at a time, from a state.
    pub fn state(&self, x: Vec<f64>, end: f64) -> Vec<f64> {
        self.run_from(Some(x), &[end], None).1
    }

    /// Rows of outputs at these times.
    pub fn run(&self, times: &[f64]) -> Vec<Vec<f64>> {
        self.run_from(None, times, None).0
    }
}

fn rows(model: &dyn Model, outputs: &[&str]) -> usize {
    let spec = model.spec();
    let size = |name: &&str| spec.outputs.iter().chain(&spec.states).find(|q| q.name == *name).unwrap().size;
    outputs.iter().map(size).sum()
}

/// `n + 1` equally spaced times up to `end`.
pub fn times(end: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| end * i as f64 / n as f64).collect()
}
