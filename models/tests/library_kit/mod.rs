//! Models to try built-in effects on: every kind of the catalogue, and equations with places that no kind has.

#![allow(dead_code)] // each test file uses its own part

#[path = "systems.rs"]
mod systems;

use starlings_models::effect::scale;
use starlings_models::{BuildSetup, EffectDef, Job, ParticleError, Setup, Signal, Spec, Window};

use crate::common;

/// A model with everything that a run needs.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) name: String,
    /// Without the effects.
    pub(crate) spec: Spec,
    pub(crate) window: Window,
    pub(crate) setup: Setup,
    pub(crate) theta: Vec<f64>,
    /// Lengths of the rows of the prediction: a field has several.
    sizes: Vec<usize>,
}

/// Number of observation times.
const TIMES: u32 = 12;

/// Part of a second that is simulated: waves and many small steps make some models slow.
fn seconds(kind: &str) -> f64 {
    match kind {
        "fsi-tube" | "artery-1d" | "toy-fsi" | "toy-fsi-windkessel" | "toy-fsi-stokes"
        | "rocket-motor-1d" => 0.02,
        _ => 1.0,
    }
}

/// Factor on the inputs: a nozzle hardly turns under a few newtons.
fn strength(kind: &str) -> f64 {
    if kind == "thrust-vector-control" { 1e4 } else { 1.0 }
}

/// Every model.
pub(crate) fn benches() -> Vec<Bench> {
    let native = common::kinds().into_iter().filter(|kind| kind != starlings_models::catalogue::EQUATIONS);
    let native = native.map(|kind| {
        let (setup, theta) = common::setup(&kind);
        (kind, setup, theta)
    });
    native.chain(systems::all()).map(|(name, setup, theta)| Bench::new(name, setup, theta)).collect()
}

impl Bench {
    fn new(name: String, mut setup: Setup, theta: Vec<f64>) -> Self {
        let spec = setup.spec().unwrap();
        setup.outputs = spec.outputs.iter().map(|q| q.name.clone()).collect();
        let mut sizes: Vec<usize> = spec.outputs.iter().map(|q| q.size).collect();
        for state in spec.states.iter().filter(|q| q.size == 1) {
            if setup.outputs.contains(&state.name) {
                continue;
            }
            setup.outputs.push(state.name.clone());
            sizes.push(1);
        }
        let span = seconds(&name);
        let clock = |i: i32, n: u32| span * f64::from(i) / f64::from(n);
        let times: Vec<f64> = (1..=TIMES).map(|i| span * f64::from(i) / f64::from(TIMES)).collect();
        // From before the start, on other times than those observed.
        let sampled: Vec<f64> = (-9..=37).map(|i| clock(i, 36) - 0.004 * span).collect();
        let signal = |k: usize| {
            let value = |t: &f64| strength(&name) * (20.0 + 15.0 * (9.0 * t / span + k as f64).sin());
            let values = sampled.iter().map(value).collect();
            Signal { times: sampled.clone(), values }
        };
        let window =
            Window::free(0.0, times, sizes.iter().sum(), (0..spec.inputs.len()).map(signal).collect());
        Self { name, spec, window, setup, theta, sizes }
    }

    /// Runs the model with effects in its units; `amplitude` is that of each, inner parameters stand at the middle of their grids.
    pub(crate) fn run(&self, effects: &[EffectDef], amplitude: f64) -> Result<Vec<f64>, ParticleError> {
        let mut setup = Setup { effects: effects.to_vec(), ..self.setup.clone() };
        let mut theta = self.theta.clone();
        for effect in effects {
            setup.parameters.push(effect.parameters[0].name.clone());
            theta.push(amplitude);
        }
        self.run_from(&setup, &theta, None)
    }

    /// Runs another model over the same window, from a state or its own start.
    pub(crate) fn run_from(
        &self,
        setup: &Setup,
        theta: &[f64],
        state: Option<Vec<f64>>,
    ) -> Result<Vec<f64>, ParticleError> {
        let names: Vec<&str> = setup.effects.iter().map(|effect| effect.name.as_str()).collect();
        let model = setup.build().unwrap_or_else(|e| panic!("{}, {names:?}: {e}", self.name));
        let state = state.map(Into::into);
        model.run(&Job { state, ..common::job(&self.window, theta) }).map(|prediction| prediction.outputs)
    }

    /// The effect in the units of this model; nothing where what it counts in does not move here.
    pub(crate) fn resolved(&self, effect: &EffectDef) -> Option<EffectDef> {
        let plain = self.run(&[], 0.0).unwrap();
        let n_obs: usize = self.sizes.iter().sum();
        let course = |name: &str| -> Option<[f64; 2]> {
            let values: Vec<f64> = match self.setup.outputs.iter().position(|output| output == name) {
                Some(row) => {
                    let first: usize = self.sizes[..row].iter().sum();
                    plain.iter().skip(first).step_by(n_obs).copied().collect()
                }
                None => {
                    self.window.inputs[self.spec.inputs.iter().position(|q| q.name == name)?].values.clone()
                }
            };
            Some([
                values.iter().copied().fold(f64::INFINITY, f64::min),
                values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ])
        };
        let end = self.window.times[self.window.times.len() - 1];
        let resolved = scale::resolve(effect, &course, [0.0, end], end / f64::from(TIMES));
        scale::is_resolved(&resolved).then_some(resolved)
    }

    /// Largest difference of two predictions over the largest value of their row.
    pub(crate) fn difference(&self, a: &[f64], b: &[f64]) -> f64 {
        let n_obs: usize = self.sizes.iter().sum();
        let of_row = |row: usize| {
            let pairs = || a.iter().zip(b).skip(row).step_by(n_obs);
            let largest = pairs().map(|(a, _)| a.abs()).fold(0.0, f64::max);
            let difference = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if difference > 0.0 { difference / largest.max(1e-12) } else { 0.0 }
        };
        (0..n_obs).map(of_row).fold(0.0, f64::max)
    }
}

/// Amplitudes to try, within what physics allows.
pub(crate) fn amplitudes(effect: &EffectDef) -> Vec<f64> {
    let [lo, hi] = effect.parameters[0].range;
    let sizes: Vec<f64> = if hi.is_finite() {
        vec![0.9 * hi, 0.5 * hi, 0.1 * hi]
    } else {
        vec![0.3, 10.0, 1e-2, 1e3, 1e-4, 1e5, 1e9]
    };
    let signed = sizes.iter().flat_map(|a| [*a, -a]);
    signed.filter(|a| (lo..=hi).contains(a)).collect()
}
